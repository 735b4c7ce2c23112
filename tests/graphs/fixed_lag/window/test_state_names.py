# SPDX-License-Identifier: BSD-3-Clause
"""What components of a state are called, and in which unit they are told."""

from jointscope.graphs.fixed_lag.window.state_names import state_names, state_unit
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot


def test_the_lag_of_an_encoder_is_told_in_radians_and_other_memories_have_no_unit():
    robot = add_effect(add_effect(load_robot("biorob"), "encoder_hysteresis@joint2.link"), "hysteresis@joint1")
    units = {name: state_unit(robot, name) for name in state_names(robot.layout)}
    assert units["encoder_hysteresis@joint2.link.memory"] == "rad"
    assert units["hysteresis@joint1.memory"] == ""
    assert units["joint1.v_link"] == "rad/s"
