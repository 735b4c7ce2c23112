#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# mujoco 4.0.0 takes several numbers for the damping of a joint: damping="1 2 3" is the force -(1 v + 2 v|v| + 3 v^3).
# pin 4.1.0 reads such a joint with no damping at all: not even its first number, which alone would be read, and no warning.
# (MuJoCo's springs look alike and are not: stiffness="10 5" is -(10 x + 5 x^2), stiffer on one side and softer on the other;
# its dampers are the same in both directions. Who writes a hardening spring needs stiffness="10 0 5".)
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

MODEL = """<mujoco><option gravity="0 0 0"/><worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0" {what}/>
<geom name="box" type="sphere" size="0.1" mass="1"/></body></worldbody></mujoco>"""


def passive(what, position=0.0, velocity=0.0):
    """Force of spring and damper on the cart [N] in MuJoCo."""
    model = mujoco.MjModel.from_xml_string(MODEL.format(what=what))
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = position, velocity
    mujoco.mj_forward(model, data)
    return float(data.qfrc_passive[0])


def damping_read(what):
    with open("model.xml", "w") as file:
        file.write(MODEL.format(what=what))
    return float(pin.buildModelFromMJCF("model.xml").damping[0])


for what in ('damping="1"', 'damping="1 2 3"'):
    forces = [passive(what, velocity=v) for v in (0.5, -0.5)]
    print(f"{what}: mujoco {mujoco.__version__} forces at +-0.5 m/s {forces}, pinocchio {pin.__version__} damping {damping_read(what)}")
assert damping_read('damping="1"') == 1.0
assert damping_read('damping="1 2 3"') == 0.0
assert np.allclose([passive('damping="1 2 3"', velocity=v) for v in (0.5, -0.5)], [-1.375, 1.375])
springs = [passive('stiffness="10 5"', position=x) for x in (0.3, -0.3)]
print(f'stiffness="10 5": forces at +-0.3 m {springs}')
assert np.allclose(springs, [-3.45, 2.55])
PYTHON
