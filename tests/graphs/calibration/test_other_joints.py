# SPDX-License-Identifier: BSD-3-Clause
"""What hangs on a joint that follows, or on one that is held somewhere, counts: recordings made elsewhere."""

from dataclasses import replace
from pathlib import Path

import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.tools.bags.read_recording import read_recording

CASES = Path(__file__).resolve().parents[3].parent / "shared" / "cases"
TRUTH = {"shoulder.torque_constant": 2.0, "shoulder.coulomb_torque": 0.5, "shoulder.motor_viscous.coefficient": 0.4}


@pytest.mark.parametrize(("name", "posture"), [("mimic", {}), ("held_elbow", {"elbow": 2.0})])
def test_the_second_link_is_where_it_is(name, posture, tmp_path):
    if not (CASES / f"{name}.yaml").is_file():
        pytest.skip("shared/cases is not beside the project: its recordings cannot be tested")
    robot = load_robot(CASES / f"{name}.yaml")
    recording = replace(read_recording(CASES / f"{name}.mcap", robot).between(0.0, 3.0), posture=posture)
    result = calibrate(robot, [recording])
    for parameter in result.parameters:
        truth = TRUTH[parameter.name]
        assert abs(parameter.value - truth) < max(0.01 * truth, 3.5 * parameter.sigma)
        assert parameter.sigma < 0.01 * truth
    # the file that is written tells the posture, and says the same of a recording that does not
    (tmp_path / "found.yaml").write_text(robot_text(result.robot, tmp_path))
    assert load_robot(tmp_path / "found.yaml").tree.locked == posture
    said = [finding for finding in result.findings if "not moved" in finding]
    assert said == (["elbow is not moved: held at 2 rad as in the recording"] if posture else [])
