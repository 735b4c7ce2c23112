# SPDX-License-Identifier: BSD-3-Clause
"""Drives and bearings of arms that another program simulated, from frequency responses."""

from __future__ import annotations

import pytest
from shaken_arm import TX90L, truth

from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.robots.errors import SolveError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.read_shaken import read_shaken

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not TX90L.is_dir(), reason="shared/data/tx90l is not beside the project"),
]


def calibrated(name):
    robot = load_robot("tx90l")
    return calibrate_frequency(robot, [read_shaken(TX90L / name / f"frequency_{p}", robot) for p in ("P1", "P3")])


def errors(result, name):
    found = {}
    for parameter, true in truth(name).items():
        p = result.robot.parameters[parameter]
        found[parameter] = (p.value / true - 1.0, (p.value - true) / p.sigma, p.sigma / true)
    return found


def test_drives_and_bearings_are_right_within_their_sigmas_and_a_damper_is_named_that_nothing_tells():
    result = calibrated("frequency")
    for name, (relative, in_sigmas, sigma) in errors(result, "frequency").items():
        assert abs(in_sigmas) < 3.0, name
        if name.endswith("stiffness"):
            assert abs(relative) < 0.01 and sigma < 0.02, name
        elif "stiffness" in name:
            assert abs(relative) < 0.04 and sigma < 0.05, name
    assert result.silent == ("joint2.bearing.damping_x",)
    assert result.rms_log(result.robot)["rms_log"] < result.rms_log(result.start)["rms_log"]


def test_a_soft_bearing_is_told_from_one_realisation():
    result = calibrated("frequency_soft_bearing")
    for name, (relative, in_sigmas, _) in errors(result, "frequency_soft_bearing").items():
        assert abs(in_sigmas) < 3.0, name
        if name.startswith("joint2.bearing.stiffness"):
            assert abs(relative) < 0.05, name


def test_torques_of_another_sign_end_in_a_sentence():
    robot = load_robot("tx90l")
    signals, excitation = read_shaken(TX90L / "frequency" / "frequency_P1", robot)
    signals.inputs.values[:] *= -1.0
    with pytest.raises(SolveError):
        calibrate_frequency(robot, [(signals, excitation)])
