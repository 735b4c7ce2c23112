#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# pin 4.1.0: a model that was read with mimic=True has one coordinate for a joint and the one that follows it, and crba and rnea
# account for both. But aba, computeABADerivatives and computeRNEADerivatives refuse such a model: it can be asked for
# its mass matrix and its torques, not be simulated or differentiated. Without mimic=True the tag is ignored: two free joints.
# What helps: keep all joints, and project by q_all = G q + offset (M = G' M_all G); robots/ does so.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip --quiet --disable-pip-version-check install "pin==4.1.0" "numpy==2.4.6"
"$folder/venv/bin/python" - <<'PYTHON'
import numpy as np
import pinocchio as pin

BODY = """<inertial><mass value="1"/><origin xyz="0.1 0 0"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>"""
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
URDF = f"""<robot name="finger"><link name="base"/>
<joint name="near" type="revolute"><parent link="base"/><child link="first"/><axis xyz="0 0 1"/>{LIMIT}</joint>
<link name="first">{BODY}</link>
<joint name="far" type="revolute"><parent link="first"/><child link="second"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/>{LIMIT}
<mimic joint="near" multiplier="-0.5" offset="0.2"/></joint>
<link name="second">{BODY}</link></robot>"""
print("pin", pin.__version__)
plain = pin.buildModelFromXML(URDF)
coupled = pin.buildModelFromXML(URDF, mimic=True)
print("coordinates without and with mimic=True:", plain.nq, coupled.nq)
assert (plain.nq, coupled.nq, coupled.nv) == (2, 1, 1)

q, G = np.array([0.3]), np.array([[1.0], [-0.5]])
M_all = pin.crba(plain, plain.createData(), np.array([0.3, -0.5 * 0.3 + 0.2]))
M_all = np.triu(M_all) + np.triu(M_all, 1).T
M = pin.crba(coupled, coupled.createData(), q)
print("mass matrix of the pair, and by projection:", M.item(), (G.T @ M_all @ G).item())
assert abs(M.item() - (G.T @ M_all @ G).item()) < 1e-12

for name in ("aba", "computeABADerivatives", "computeRNEADerivatives"):
    try:
        getattr(pin, name)(coupled, coupled.createData(), q, np.zeros(1), np.zeros(1))
    except RuntimeError as err:
        print(f"{name}: {err}")
        assert "Mimic" in str(err)
    else:
        raise SystemExit(f"{name} accepts mimic joints now")
PYTHON
