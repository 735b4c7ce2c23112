#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# pin 4.1.0: a joint of type continuous, which has no limits in the URDF, gets position limits of -1.01 and 1.01: its two
# coordinates are a cosine and a sine. Whoever compares measured angles with model.lowerPositionLimit by index sees a robot
# that turns far beyond its limits, and with joints behind it every index is off by one, as nq is larger than nv.
# Its velocity limit, where the URDF gives none, is infinite.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip --quiet --disable-pip-version-check install "pin==4.1.0" "numpy==2.4.6"
"$folder/venv/bin/python" - <<'PYTHON'
import numpy as np
import pinocchio as pin

BODY = """<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>"""
URDF = f"""<robot name="wheel"><link name="base"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="first"/><axis xyz="0 0 1"/></joint>
<link name="first">{BODY}</link>
<joint name="bend" type="revolute"><parent link="first"/><child link="second"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="1" velocity="3"/></joint>
<link name="second">{BODY}</link></robot>"""
model = pin.buildModelFromXML(URDF)
print("pin", pin.__version__, "nq", model.nq, "nv", model.nv)
print("lower", model.lowerPositionLimit, "upper", model.upperPositionLimit, "velocity", model.velocityLimit)
assert (model.nq, model.nv) == (3, 2)
assert np.allclose(model.lowerPositionLimit, [-1.01, -1.01, -2.0])
assert np.allclose(model.upperPositionLimit, [1.01, 1.01, 2.0])
assert np.isinf(model.velocityLimit[0]) and model.velocityLimit[0] > 0
PYTHON
