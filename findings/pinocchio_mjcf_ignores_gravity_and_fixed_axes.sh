#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# pin 4.1.0: two settings of MJCF that change what every number of a file means are not taken over by buildModelFromMJCF.
# Gravity stays 9.81 along -z whatever <option gravity="..."/> says: an arm that hangs on a wall, or that stands on the moon, has
# the torques of one that stands on earth. Capitals in <compiler eulerseq="XYZ"/> mean axes that stay fixed; they are read as
# axes that move along, so bodies with two or three angles stand askew. Small letters are read rightly.
# What helps: set model.gravity.linear by hand; write quaternions.
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

MODEL = """<mujoco>{settings}<worldbody><body name="arm" euler="10 20 30"><joint name="swing" axis="0 1 0"/>
<geom name="ball" type="sphere" size="0.1" mass="1" pos="0.3 0.1 0.2"/></body></worldbody></mujoco>"""


def torques(settings):
    """Torque of gravity on the joint at zero [N m], in MuJoCo and in pinocchio."""
    text = MODEL.format(settings=settings)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with open("model.xml", "w") as file:
        file.write(text)
    read = pin.buildModelFromMJCF("model.xml")
    zero = np.zeros(1)
    return float(data.qfrc_bias[0]), float(pin.rnea(read, read.createData(), zero, zero, zero)[0])


SETTINGS = {
    "": True,
    '<compiler eulerseq="zyx"/>': True,
    '<compiler eulerseq="XYZ"/>': False,
    '<option gravity="0 0 -1.62"/>': False,
    '<option gravity="-9.81 0 0"/>': False,
}
for settings, same in SETTINGS.items():
    ours, read = torques(settings)
    print(f"{settings or 'no setting'}: mujoco {mujoco.__version__} {ours:.4f}, pinocchio {pin.__version__} {read:.4f} N m")
    assert np.isclose(ours, read) == same
PYTHON
