#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# mujoco 4.0.0: a body made with MjSpec.add_body(explicitinertial=True, mass=..., inertia=...) and no `ipos` compiles with that
# mass and inertia, about its own origin. to_xml() leaves its <inertial> out, as `ipos` is not a number: read back, a
# body with a geom silently has the mass of the geom (here 4.19 instead of 1 kg), and one without any is refused as massless.
# With ipos=[0, 0, 0] the saved model is the compiled one.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip --quiet --disable-pip-version-check install "mujoco==4.0.0" "numpy==2.4.6"
"$folder/venv/bin/python" - <<'PYTHON'
import mujoco
import numpy as np


def masses(**place):
    """Mass of a body as compiled, and after saving and reading it back."""
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="rotor", explicitinertial=True, mass=1.0, inertia=[2.0, 2.0, 2.0], **place)
    body.add_joint(name="turn")
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0.0, 0.0])
    compiled = spec.compile()
    again = mujoco.MjModel.from_xml_string(spec.to_xml())
    return compiled.body("rotor").mass[0], again.body("rotor").mass[0]


without, given = masses(), masses(ipos=[0.0, 0.0, 0.0])
print("mujoco", mujoco.__version__, "mass compiled and read back, without ipos", without, "with", given)
assert np.allclose(without, [1.0, 4.18879], atol=1e-4)
assert np.allclose(given, [1.0, 1.0])
PYTHON
