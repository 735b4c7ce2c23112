#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# pin 4.1.0: buildModelFromMJCF reads the first body of <worldbody> with all that hangs on it, and leaves out the bodies beside it
# without a word. A file with two arms on one table gives the first arm; change their order, and it is the other. Rotors that
# stand as bodies of their own beside an arm, and act on it by tendons, are left out the same way.
# mujoco 4.0.0 has all of them. What helps: put what stands beside each other into one fixed body, and compare nv.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip --quiet --disable-pip-version-check install "pin==4.1.0" "mujoco==4.0.0" "numpy==2.4.6"
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import mujoco
import pinocchio as pin

ARM = '<body name="{0}" pos="0 {1} 0"><joint name="{0}_swing" axis="0 1 0"/><geom name="{0}_ball" size="0.1" mass="1" pos="0.3 0 0"/></body>'
ARMS = [ARM.format("left", 0.5), ARM.format("right", -0.5)]


def both(bodies):
    """Joints as MuJoCo and as pinocchio have them."""
    text = f"<mujoco><worldbody>{bodies}</worldbody></mujoco>"
    with open("model.xml", "w") as file:
        file.write(text)
    engine, read = mujoco.MjModel.from_xml_string(text), pin.buildModelFromMJCF("model.xml")
    return [engine.joint(k).name for k in range(engine.njnt)], [name for name in read.names if name != "universe"]


beside, turned, in_one = "".join(ARMS), "".join(reversed(ARMS)), '<body name="table">' + "".join(ARMS) + "</body>"
for label, bodies in (("two arms", beside), ("the other way round", turned), ("in one fixed body", in_one)):
    engine, read = both(bodies)
    print(f"{label}: mujoco {mujoco.__version__} {engine}, pinocchio {pin.__version__} {read}")
assert both(beside) == (["left_swing", "right_swing"], ["left_swing"])
assert both(turned) == (["right_swing", "left_swing"], ["right_swing"])
assert sorted(both(in_one)[1]) == ["left_swing", "right_swing"]
PYTHON
