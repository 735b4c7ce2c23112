#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# pin 4.1.0: buildModelFromMJCF steps over <frame>, which in MJCF only moves what stands in it: bodies and geoms inside are left
# out without a word. A hand that MjSpec.attach of mujoco 4.0.0 puts on the flange of an arm is written in such a frame:
# here an arm and a hand of 1 kg each, hand 1 m from the joint, have 2 kg in MuJoCo and 1 kg in pinocchio, and the
# hand's weight is missing on the joint. What helps: compare the total mass, or write the hand's pose into its body.
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

ARM = """<mujoco><worldbody><body name="arm"><joint name="swing" axis="0 1 0"/><geom name="beam" type="sphere" size="0.1" mass="1"
pos="0.1 0 0"/><site name="flange" pos="1 0 0"/></body></worldbody></mujoco>"""
HAND = '<mujoco><worldbody><body name="hand"><geom name="palm" type="sphere" size="0.1" mass="1"/></body></worldbody></mujoco>'


def with_mujoco(text):
    """Mass [kg] and torque of gravity on the joint at zero [N m]."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return float(model.body_mass.sum()), float(data.qfrc_bias[0])


def with_pinocchio(text):
    with open("model.xml", "w") as file:
        file.write(text)
    model = pin.buildModelFromMJCF("model.xml")
    zero = np.zeros(1)
    return float(pin.computeTotalMass(model)), float(pin.rnea(model, model.createData(), zero, zero, zero)[0])


arm = mujoco.MjSpec.from_string(ARM)
arm.attach(mujoco.MjSpec.from_string(HAND), site="flange", prefix="hand_")
arm.compile()
attached = arm.to_xml()
by_hand = ARM.replace("</body>", '<body name="hand" pos="1 0 0"><geom name="palm" type="sphere" size="0.1" mass="1"/></body></body>')
for label, text in (("hand attached at the flange", attached), ("hand with a pose of its own", by_hand)):
    print(f"{label}: mujoco {mujoco.__version__} {with_mujoco(text)}, pinocchio {pin.__version__} {with_pinocchio(text)} [kg, N m]")
assert "<frame" in attached and "<frame" not in by_hand
assert np.allclose(with_mujoco(attached), (2.0, -1.1 * 9.81)) and np.allclose(with_pinocchio(attached), (1.0, -0.1 * 9.81))
assert np.allclose(with_mujoco(by_hand), (2.0, -1.1 * 9.81)) and np.allclose(with_pinocchio(by_hand), (2.0, -1.1 * 9.81))
PYTHON
