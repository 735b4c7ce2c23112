# SPDX-License-Identifier: BSD-3-Clause
"""Known loads of a bag that cannot hang on the robot are refused in a sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.read_rests import check_loads

ROBOT = load_robot("biorob")
NOTHING = np.zeros((1, 3))


def refused(forces, torques, link):
    with pytest.raises(RecordingError) as err:
        check_loads(Path("bench"), ROBOT, np.atleast_2d(forces), np.atleast_2d(torques), [link])
    return str(err.value)


def test_a_force_on_a_link_is_fine():
    check_loads(Path("bench"), ROBOT, np.array([[0.0, 3.0, -2.0]]), NOTHING, ["attachment"])


def test_a_frame_that_is_not_in_the_urdf_is_answered_with_the_right_one():
    assert refused([0.0, 1.0, 0.0], NOTHING, "atachment") == (
        "bench: topic /load: no link 'atachment' in biorob.urdf; did you mean 'attachment'?; header.frame_id names the "
        "link at whose origin the force acts"
    )


def test_grams_are_no_newtons():
    assert refused([0.0, 0.0, -1500.0], NOTHING, "attachment") == (
        "bench: topic /load: a force of 1500 N on a robot that weighs 23.8 N; expected newton: kilograms times 9.81, "
        "grams times 0.00981"
    )


def test_torques_and_what_is_no_number_are_refused():
    assert "torques of up to 2 N m; expected forces alone" in refused(NOTHING, [0.0, 2.0, 0.0], "attachment")
    assert "a force is no number; remove these messages" in refused([np.nan, 0.0, 0.0], NOTHING, "attachment")
