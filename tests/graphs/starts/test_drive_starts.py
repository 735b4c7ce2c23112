# SPDX-License-Identifier: BSD-3-Clause
"""Calibrations of rigid joints begin where the regression says, or where the robot file does if that is as good."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, divided, moved, written

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.starts.initial_guess import initial_dynamics, initial_states
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording

ARM = Arm("yx", inertia=(0.7, 0.2), dry=(2.0, 0.8), viscous=(1.5, 0.6))
CONSTANTS = (9.0, 4.0)  # [N m/A]
YAML = """
format: 1
name: arm
urdf: arm.urdf
gravity: [0.0, 0.0, -9.81]
joints: [j0, j1]
model: {{rigid_joints: [j0, j1], friction_sharpness: 400.0}}
command: {{topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: {unit}}}
sensors:
  encoder: {{kind: motor_encoder, topic: /js, type: sensor_msgs/msg/JointState, field: position, unit: rad,
            sigma: 1.0e-5}}
effects: [{effects}]
parameters:
  j0.inertia: {{value: 7.0, unit: kg m2}}
  j1.inertia: {{value: 0.01, unit: kg m2}}
  j0.coulomb_torque: {{value: 40.0, unit: N m}}
  j1.coulomb_torque: {{value: 0.01, unit: N m}}
{more}
noise: {{link_velocity: [0.3, 0.3], motor_velocity: [0.3, 0.3]}}
"""
VISCOUS = (
    "  {0}.motor_viscous.coefficient: {{value: 0.0, unit: N m s/rad, prior: 0.0, prior_sigma: 50.0, positive: false}}"
)
CONSTANT = "  {0}.torque_constant: {{value: 1.0, unit: N m/A}}"
BOTH = "motor_viscous@j0, motor_viscous@j1"


@pytest.fixture(scope="module")
def streams():
    return moved(ARM)


@pytest.fixture
def robot(tmp_path):
    def make(unit="N m", effects=BOTH, more=(VISCOUS,), more_parameters=""):
        written(ARM, tmp_path)
        rows = "\n".join(row.format(joint) for row in more for joint in ARM.joints) + more_parameters
        (tmp_path / "arm.yaml").write_text(YAML.format(unit=unit, effects=effects, more=rows))
        return load_robot(tmp_path / "arm.yaml")

    return make


def started(robot, streams, **changes):
    """Values at which a calibration of a recording begins."""
    recording = Recording("", "", 10**18, dict(zip(("encoder", "command"), streams, strict=True)))
    robot = replace(robot, parameters={n: replace(p, **changes.get(n, {})) for n, p in robot.parameters.items()})
    problem, calibration = BagProblem.of(robot, recording), Calibration.of(robot)
    found = initial_dynamics([problem], [initial_states(problem, calibration)], calibration)
    return found.by_name


def truth():
    rows = {"inertia": ARM.inertia, "coulomb_torque": ARM.dry, "motor_viscous.coefficient": ARM.viscous}
    return {f"j{i}.{law}": values[i] for law, values in rows.items() for i in range(2)}


def test_torque_commands_begin_at_the_regression_however_far_the_file_is(robot, streams):
    assert started(robot(), streams) == pytest.approx(truth(), rel=0.015)


def test_currents_begin_with_their_constants(robot, streams):
    encoder, command = streams
    found = started(robot("A", more=(VISCOUS, CONSTANT)), (encoder, divided(command, CONSTANTS)))
    constants = {f"j{i}.torque_constant": CONSTANTS[i] for i in range(2)}
    assert found == pytest.approx(truth() | constants, rel=0.02)


def test_back_emf_stands_for_viscous_friction(robot, streams):
    encoder, command = streams
    rows = ("  {0}.k_pwm: {{value: 1.0, unit: N m/V}}", "  {0}.k_mi: {{value: 0.1, unit: N m s/rad}}")
    found = started(robot("V", "", rows), (encoder, divided(command, CONSTANTS)))
    for i in range(2):
        assert found[f"j{i}.k_pwm"] == pytest.approx(CONSTANTS[i], rel=0.01)
        assert found[f"j{i}.k_mi"] == pytest.approx(ARM.viscous[i], rel=0.02)


def test_what_is_fixed_stays_and_the_others_are_found_with_it(robot, streams):
    held = {"j0.inertia": {"value": 0.7, "fixed": True}, "j1.motor_viscous.coefficient": {"value": 0.6, "fixed": True}}
    found = started(robot(), streams, **held)
    assert not set(held) & set(found)
    assert found == pytest.approx({n: v for n, v in truth().items() if n not in held}, rel=0.015)


def test_a_file_that_explains_the_motion_as_well_keeps_the_word(robot, streams):
    first = started(robot(), streams)
    again = started(robot(), streams, **{name: {"value": value} for name, value in first.items()})
    assert again == first


def test_a_joint_with_further_effects_is_left_where_the_file_is_near(robot, streams):
    more = "\n  j0.torque_offset.torque: {value: 0.0, unit: N m, prior: 0.0, prior_sigma: 1.0, positive: false}"
    with_offset = robot(effects=f"{BOTH}, torque_offset@j0", more_parameters=more)
    near = {name: {"value": 1.0005 * value} for name, value in started(robot(), streams).items()}
    found = started(with_offset, streams, **near)
    for name in truth():
        assert (found[name] == pytest.approx(near[name]["value"], rel=1e-9)) == name.startswith("j0"), name


def test_one_parameter_of_two_joints_is_a_mean_of_both(robot, streams):
    shared = robot()
    parameters = {n: p for n, p in shared.parameters.items() if not n.endswith(".inertia")}
    parameters["motor.inertia"] = replace(shared.parameters["j0.inertia"], name="motor.inertia")
    found = started(replace(shared, parameters=parameters), streams)
    assert ARM.inertia[1] < found["motor.inertia"] < ARM.inertia[0]


@pytest.mark.parametrize("unit", ["N m", "A"])
def test_a_joint_that_moves_against_its_command_is_named(robot, streams, unit):
    encoder, command = streams
    rows = (VISCOUS, CONSTANT) if unit == "A" else (VISCOUS,)
    turned = replace(command, values=command.values * np.array([1.0, -1.0]))
    with pytest.raises(RecordingError, match=r"j1 moves against its command \(\d+ sigma\)"):
        started(robot(unit, more=rows), (encoder, turned))
