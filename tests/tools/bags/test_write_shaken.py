# SPDX-License-Identifier: BSD-3-Clause
"""Bags of a shaken arm and excitation.yaml: what is written is what is read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shaken_arm import made_up

from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.read_shaken import read_shaken
from jointscope.tools.bags.at_poses.write_shaken import write_shaken


@pytest.mark.parametrize("carrier", [0.0, 0.03])
def test_signals_and_excitation_come_back(carrier, tmp_path):
    robot = load_robot("tx90l")
    both = [made_up(seed, carrier) for seed in (0, 1)]
    named = [(f"pose_{i}", signals, signals.inputs.values) for i, (signals, _) in enumerate(both)]
    paths = write_shaken(tmp_path / "arm", robot, named, both[0][1], "said: more\n")
    assert [path.name for path in paths] == ["pose_0.mcap", "pose_1.mcap"]
    for path, (signals, excitation) in zip(paths, both, strict=True):
        read, how = read_shaken(path, robot)
        for a, b in ((read.inputs, signals.inputs), (read.outputs, signals.outputs)):
            assert a.names == b.names
            np.testing.assert_allclose(a.values, b.values, rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(a.times - a.times[0], b.times - b.times[0], atol=2e-9)
        assert (how.f0, how.carrier, how.experiments) == (excitation.f0, excitation.carrier, excitation.experiments)
        np.testing.assert_array_equal(how.lines, excitation.lines)


def test_messages_that_cannot_be_written_are_named_before_anything_is(tmp_path):
    robot = load_robot("tx90l")
    other = replace(robot.frequency, torques=replace(robot.frequency.torques, msgtype="geometry_msgs/msg/Wrench"))
    signals, excitation = made_up()
    with pytest.raises(RobotError, match="geometry_msgs/msg/Wrench can be read, not written"):
        write_shaken(
            tmp_path / "arm", replace(robot, frequency=other), [("one", signals, signals.inputs.values)], excitation, ""
        )
    assert not list(tmp_path.iterdir())
