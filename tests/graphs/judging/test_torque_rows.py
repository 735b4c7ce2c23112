# SPDX-License-Identifier: BSD-3-Clause
"""Columns of settings and readings against an arm that the engine simulates with one of them wrong."""

import numpy as np
import pytest
from tilted_arm import URDF

from jointscope.factors.calibration import Calibration
from jointscope.graphs.judging.torque_rows import TorqueEquations
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.scoring.columns.hypotheses import hypotheses_of
from jointscope.graphs.scoring.score_system import Segment
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator import simulate

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

YAML = """
format: 1
name: arm
urdf: arm.urdf
gravity: [0.0, 0.0, -9.81]
joints: [shoulder, elbow]
model: {rigid_joints: [shoulder, elbow]}
command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  enc: {kind: motor_encoder, topic: /js, type: sensor_msgs/msg/JointState, field: position, unit: rad, sigma: 1.0e-6}
parameters:
  shoulder.inertia: {value: 0.5, unit: kg m2}
  shoulder.coulomb_torque: {value: 0.8, unit: N m}
  elbow.inertia: {value: 0.2, unit: kg m2}
  elbow.coulomb_torque: {value: 0.8, unit: N m}
noise: {link_velocity: [0.3, 0.3], motor_velocity: [0.3, 0.3]}
"""
BAND = 15.0  # [Hz]


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.urdf").write_text(URDF.format(speed=4))
    (folder / "arm.yaml").write_text(YAML)
    return load_robot(folder / "arm.yaml")


def equations(arm, effects, moved=0.0, late=0):
    """Rows of the model without an effect along the motion that encoders with it report."""
    made = simulate(arm, "moves", 5.0, 4, effects=effects, friction="smooth")
    x = made.states[:, :4] + np.array([0.0, moved, 0.0, 0.0])
    problem = BagProblem.of(arm, made.recording)
    ticks = problem.timeline.ticks
    x = np.column_stack([np.interp(ticks - 1e-3 * late, made.state_times, column) for column in x.T])
    return TorqueEquations.of([Segment.of(problem, x, Calibration.of(arm))], BAND)


@pytest.mark.parametrize(
    ("label", "sizes", "seen", "report"),
    [
        ("torque_constant_error@shoulder", {"share": 0.05}, {"share": 0.05 / 1.05}, {}),
        ("link_mass@elbow", {"mass": 0.5, "x": 0.01, "y": 0.0, "z": 0.0}, None, {}),
        ("link_mass@shoulder", {"mass": 0.5, "x": 0.01, "y": 0.0, "z": 0.0}, None, {}),
        ("gravity_direction@robot", {"x": 0.05, "y": -0.03}, None, {}),
        ("encoder_offset@elbow", {"offset": 0.05}, None, {"moved": 0.05}),
        ("encoder_delay@robot", {"delay": 3e-3}, None, {"late": 3}),
    ],
)
def test_what_is_missing_is_the_size_times_the_column(arm, label, sizes, seen, report):
    text = ",".join(f"{name}={value}" for name, value in sizes.items())
    found = equations(arm, [f"{label}:{text}"], **report)
    (hypothesis,) = (h for h in hypotheses_of(arm) if h.label == label)
    expected = [
        column @ np.array([(seen or sizes)[p.name] for p in hypothesis.sizes]) for column in found.columns(hypothesis)
    ]
    without = equations(arm, [])
    for rows, plain, column in zip(found.rows, without.rows, expected, strict=True):
        floor = np.sqrt(np.mean(plain.missing**2))
        size = np.sqrt(np.mean(rows.missing**2))
        left = np.sqrt(np.mean((rows.missing - column) ** 2))
        assert left < 0.1 * size + 2.0 * floor + 2e-3, (rows.joint, size, left, floor)
    assert max(np.sqrt(np.mean(rows.missing**2)) for rows in found.rows) > 0.05


def rms(values):
    return np.sqrt(np.mean(values**2))


def test_what_one_drive_lacks_stands_in_the_equation_of_its_joint_alone(arm):
    found = equations(arm, ["torque_constant_error@shoulder:share=0.2"])
    without = equations(arm, [])
    assert rms(found.rows[0].missing) > 0.1 * rms(found.rows[0].drive)
    # the links couple the joints: as an acceleration this would be seen at the elbow, too
    assert rms(found.rows[1].missing) < 1.5 * rms(without.rows[1].missing) + 1e-3 * rms(found.rows[1].drive)


SLIDE = """<robot name="slide"><link name="base"/>
<link name="carriage"><inertial><mass value="40"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="axis" type="prismatic"><parent link="base"/><child link="carriage"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1000" velocity="1"/></joint></robot>"""


def test_a_heavier_link_of_a_slide_is_a_heavier_rotor_although_a_force_is_missing(tmp_path):
    (tmp_path / "slide.urdf").write_text(SLIDE)
    (tmp_path / "slide.yaml").write_text(
        """
format: 1
name: slide
urdf: slide.urdf
gravity: [0.0, 0.0, -9.81]
joints: [axis]
model: {rigid_joints: [axis]}
command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  enc: {kind: motor_encoder, topic: /js, type: sensor_msgs/msg/JointState, field: position, unit: m, sigma: 1.0e-6}
parameters:
  axis.inertia: {value: 40.0, unit: kg}
  axis.coulomb_torque: {value: 10.0, unit: N}
noise: {link_velocity: [0.3], motor_velocity: [0.3]}
"""
    )
    slide = load_robot(tmp_path / "slide.yaml")
    made = simulate(slide, "moves", 5.0, 4, effects=["torque_offset@axis:torque=20"], friction="smooth")
    problem = BagProblem.of(slide, made.recording)
    x = np.column_stack([np.interp(problem.timeline.ticks, made.state_times, c) for c in made.states[:, :2].T])
    found = TorqueEquations.of([Segment.of(problem, x, Calibration.of(slide))], BAND)
    (mass,) = (h for h in hypotheses_of(slide) if h.label == "link_mass@axis")
    column = found.columns(mass)[0][:, 0]
    rotor = found.rows[0].base[:, Calibration.of(slide).names.index("axis.inertia")] / 40.0
    assert rms(found.rows[0].missing) == pytest.approx(20.0, rel=0.05)
    assert rms(column - rotor) < 1e-5 * rms(column)
