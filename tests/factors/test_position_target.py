# SPDX-License-Identifier: BSD-3-Clause
"""A target on a link, seen by a tracker: against pinocchio's and GTSAM's kinematics and numeric differences."""

from dataclasses import replace
from pathlib import Path

import gtsam
import numpy as np
import pinocchio as pin
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.sensor_placement import factor_on_state
from jointscope.robots.bodies.body_points import body_point
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.readings_at_one_state import ReadingsAtOneState
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.position_target import PositionTarget, turned
from jointscope.robots.parts.sensors import Topic

M = 5
MIMICKING = Path(__file__).parents[1] / "graphs/mimicking_doggy.urdf"
POSE = np.array([[0.0, -1.0, 0.0, 2.0], [0.0, 0.0, -1.0, 0.5], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]])


def with_target(turn=0.3):
    """Doggy with a target on its last link and all that may be off about it."""
    doggy = load_robot("doggy")
    source = Topic("/camera", "geometry_msgs/msg/PointStamped", "point", "m")
    sensor = PositionTarget("marker", source, "link3", np.array([0.1, -0.2, 0.9]), None, POSE, "marker", 1e-3)
    sizes = dict(
        zip(sensor.parameters, [0.01, -0.02, 0.03, 0.1, 0.2, -0.1, turn, -0.4 * turn, 0.6 * turn], strict=True)
    )
    own = {n: Parameter(n, v, sensor.parameters[n], 0.0, 0.1, positive=False) for n, v in sizes.items()}
    return replace(doggy, sensors={**doggy.sensors, "marker": sensor}, parameters={**doggy.parameters, **own})


def seen_by_gtsam(robot, q):
    """Measured position by GTSAM's poses: Rz, Ry and -Rx about one point 1.2 m above the base, as in the URDF."""
    value = {name: p.value for name, p in robot.parameters.items()}
    point = np.array([0.11, -0.22, 0.93])
    link = gtsam.Pose3(gtsam.Rot3.Rz(q[0]) * gtsam.Rot3.Ry(q[1]) * gtsam.Rot3.Rx(-q[2]), np.array([0.0, 0.0, 1.2]))
    turn = gtsam.Rot3.Expmap(np.array([value[f"marker.tracker_turn_{a}"] for a in "xyz"]))
    rotation = gtsam.Rot3(POSE[:3, :3]) * turn
    tracker = gtsam.Pose3(rotation, POSE[:3, 3] + np.array([0.1, 0.2, -0.1]))
    return tracker.transformTo(link.transformFrom(point))


@pytest.mark.parametrize("turn", [0.0, 1e-9, 0.3, 1.5])
def test_what_is_predicted_is_gtsams_forward_kinematics(turn):
    robot, rng = with_target(turn), np.random.default_rng(3)
    x = rng.normal(size=(M, robot.layout.size))
    predicted = factor_on_state(robot, "marker", np.zeros((M, 3)), np.zeros(M)).residual((x,), Calibration.of(robot))
    for k in range(M):
        np.testing.assert_allclose(predicted[k], seen_by_gtsam(robot, x[k, robot.layout.q_link]), atol=1e-12)


@pytest.mark.parametrize("label", ["", "bearing_flexibility@joint1"])
@pytest.mark.parametrize("turn", [0.0, 0.3, 1.5])
def test_derivatives_are_those_of_the_residual(label, turn):
    robot = with_target(turn) if not label else add_effect(with_target(turn), label, {})
    rng, calibration = np.random.default_rng(2), Calibration.of(robot)
    x = rng.normal(size=(M, robot.layout.size))
    factor = factor_on_state(robot, "marker", rng.normal(size=(M, 3)), np.zeros(M))
    linear = factor.linearize((x,), calibration)
    np.testing.assert_array_equal(linear.residual, factor.residual((x,), calibration))
    for i, step in enumerate(1e-6 * np.eye(robot.layout.size)):
        slope = (factor.residual((x + step,), calibration) - factor.residual((x - step,), calibration)) / 2e-6
        np.testing.assert_allclose(linear.by_state[0][:, :, i], slope, atol=1e-8)
    for i, step in enumerate(1e-6 * np.eye(len(calibration.names))):
        ends = (factor.residual((x,), calibration.retract({"dynamics": s * step})) for s in (1.0, -1.0))
        slope = np.subtract(*ends) / 2e-6
        np.testing.assert_allclose(linear.by_block["dynamics"][:, :, i], slope, atol=1e-8)
    moved = np.any(linear.by_block["dynamics"], axis=(0, 1))
    assert {name for name, m in zip(calibration.names, moved, strict=True) if m} == set(robot.sensors["marker"].own)


def test_points_of_bodies_behind_mimic_joints_are_where_pinocchio_says():
    tree, rng = RigidTree(MIMICKING, ("joint1", "joint2", "joint3"), np.zeros(3)), np.random.default_rng(8)
    assert tree.coupling is not None
    q, p = rng.normal(size=(M, 3)), np.array([0.1, 0.2, -0.3])
    data = tree.model.createData()
    for body in tree.bodies:
        found = body_point(tree, body, p, q)
        for k in range(M):
            pin.framesForwardKinematics(tree.model, data, tree.coupling.positions(q[k]))
            here = data.oMf[tree.frame_id(body)]
            np.testing.assert_allclose(found.value[k], here.act(p), atol=1e-12)
            np.testing.assert_allclose(found.R_base_body[k], here.rotation, atol=1e-12)
        for i, step in enumerate(1e-6 * np.eye(3)):
            ends = (body_point(tree, body, p, q + s * step).value for s in (1.0, -1.0))
            np.testing.assert_allclose(found.by_q[:, :, i], np.subtract(*ends) / 2e-6, atol=1e-8)


def test_the_reading_at_one_state_is_that_of_the_factor():
    robot = add_effect(with_target(), "bearing_flexibility@joint1", {})
    x = np.random.default_rng(4).normal(size=(M, robot.layout.size))
    linear = factor_on_state(robot, "marker", np.zeros((M, 3)), np.zeros(M)).linearize((x,), Calibration.of(robot))
    readings = ReadingsAtOneState(robot)
    for k in range(M):
        reading, J = readings.read("marker", x[k], 0.0)
        np.testing.assert_allclose(reading, linear.residual[k], atol=1e-12)
        np.testing.assert_allclose(J, linear.by_state[0][k], atol=1e-12)


def test_a_turn_is_gtsams_exponential_at_all_sizes():
    for size in (0.0, 1e-12, 1e-6, 1.0, 3.1, 6.0):
        turn = size * np.array([0.6, -0.64, 0.48])
        np.testing.assert_allclose(turned(turn), gtsam.Rot3.Expmap(turn).matrix(), atol=1e-12)
