#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# mujoco 4.0.0: actuators have an armature and a damping of their own, before the gear: <motor gear="10" armature="0.01"
# damping="0.02"/> adds 0.01 * 10^2 = 1 kg m^2 to the joint's inertia and 0.02 * 10^2 N m s/rad to its damping. Neither shows in
# dof_armature or dof_damping, which stay zero, nor in actuator_force or qfrc_actuator: the damper is in qfrc_passive.
# Whoever copies a robot by dof_armature, or reads the same file with pin 4.1.0, has a robot without rotors.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip --quiet --disable-pip-version-check install "pin==4.1.0" "mujoco==4.0.0" "numpy==2.4.6"
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import mujoco
import numpy as np
import pinocchio as pin

MODEL = """<mujoco><option gravity="0 0 0"/><worldbody><body name="arm"><joint name="swing" axis="0 1 0"/>
<geom name="ball" type="sphere" size="0.1" mass="1" pos="0.3 0 0"/></body></worldbody>
<actuator><motor joint="swing" gear="10" armature="0.01" damping="0.02"/></actuator></mujoco>"""
BODY = 1.0 * 0.3**2 + 0.4 * 1.0 * 0.1**2

model = mujoco.MjModel.from_xml_string(MODEL)
data = mujoco.MjData(model)
data.qvel[0] = 1.0
mujoco.mj_forward(model, data)
inertia = np.zeros((1, 1))
mujoco.mj_fullM(model, data, inertia)
with open("model.xml", "w") as file:
    file.write(MODEL)
other = pin.buildModelFromMJCF("model.xml")
read = float(pin.crba(other, other.createData(), np.zeros(1))[0, 0])
print(f"mujoco {mujoco.__version__}: inertia {inertia[0, 0]:.3f} kg m^2, dof_armature {model.dof_armature}, dof_damping {model.dof_damping}, "
      f"qfrc_passive at 1 rad/s {data.qfrc_passive}, qfrc_actuator {data.qfrc_actuator}; pinocchio {pin.__version__}: inertia {read:.3f}, "
      f"damping {other.damping}")
assert np.isclose(inertia[0, 0], BODY + 1.0) and model.dof_armature[0] == 0.0
assert np.isclose(data.qfrc_passive[0], -2.0) and model.dof_damping[0] == 0.0 and data.qfrc_actuator[0] == 0.0
assert np.isclose(read, BODY) and other.damping[0] == 0.0
PYTHON
