# SPDX-License-Identifier: BSD-3-Clause
"""The chain of an arm with errors: pinocchio's frames on nominal arms, finite differences for every derivative."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.arm_chain import ArmChain
from jointscope.robots.geometry.calibrated_urdf import calibrated_urdf
from jointscope.robots.geometry.error_parameters import error_names

RNG = np.random.default_rng(3)


@pytest.fixture(scope="module")
def robot():
    return load_robot("tx90l")


@pytest.fixture(scope="module")
def chain(robot):
    return ArmChain(robot.tree, "reflector", np.zeros(3))


@pytest.fixture(scope="module")
def poses():
    return RNG.uniform(-1.5, 1.5, (7, 6))


def some_errors(chain):
    return {name: 1e-2 * RNG.standard_normal() for name in error_names(chain.joints) if not name.startswith("tracker")}


def placed(model, frame, q):
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId(frame)].translation.copy()


def test_without_errors_the_target_is_where_pinocchio_has_it(robot, chain, poses):
    found = chain.at(poses, {}).target
    np.testing.assert_allclose(found, [placed(robot.tree.model, "reflector", q) for q in poses], atol=1e-12)


def test_gravity_is_that_of_pinocchio_on_every_axis(robot, chain, poses):
    model, data = robot.tree.model, robot.tree.model.createData()
    expected = [-pin.computeGeneralizedGravity(model, data, q) for q in poses]
    np.testing.assert_allclose(chain.at(poses, {}).gravity, expected, atol=1e-9)


def test_every_derivative_is_a_difference(chain, poses):
    errors, tilt, h = some_errors(chain), 1e-3 * RNG.standard_normal((7, 6, 2)), 1e-6
    point = chain.at(poses, errors, tilt)
    assert set(point.by_error) == set(error_names(chain.joints)) - {"tracker.lx", "tracker.ly", "tracker.lz"}
    for name, column in point.by_error.items():
        ends = [chain.at(poses, errors | {name: errors.get(name, 0.0) + s * h}, tilt).target for s in (1.0, -1.0)]
        np.testing.assert_allclose(column, (ends[0] - ends[1]) / (2 * h), atol=1e-8, err_msg=name)
    for j in range(6):
        step = h * np.eye(6)[j]
        ends = [chain.at(poses + s * step, errors, tilt).target for s in (1.0, -1.0)]
        np.testing.assert_allclose(point.by_joint[:, :, j], (ends[0] - ends[1]) / (2 * h), atol=1e-8)


def test_bearings_turn_with_the_arm_and_push_as_gravity_pulls(robot, chain, poses):
    """The torque about a bearing is minus the slope of the potential energy over its tilt."""
    h = 1e-6

    def energy(j, axis, angle):
        """Of the arm with everything behind joint j turned about x or y' = a x x of that joint, shape (m,)."""
        model = robot.tree.model.copy()
        along = np.array([0.0, 0.0, 1.0]) if chain.joints[j] in ("joint1", "joint4", "joint6") else np.eye(3)[1]
        about = np.eye(3)[0] if axis == 0 else np.cross(along, np.eye(3)[0])
        tilt = pin.SE3(pin.exp3(angle * about), np.zeros(3))
        model.inertias[j + 1] = tilt.act(model.inertias[j + 1])
        if j + 2 < model.njoints:
            model.jointPlacements[j + 2] = tilt * model.jointPlacements[j + 2]
        data = model.createData()
        return np.array([pin.computePotentialEnergy(model, data, q) for q in poses])

    point = chain.at(poses, {})
    for j in range(6):
        for axis in (0, 1):
            slope = (energy(j, axis, h) - energy(j, axis, -h)) / (2 * h)
            np.testing.assert_allclose(point.bearing_gravity[:, j, axis], -slope, atol=1e-5)


def test_the_calibrated_urdf_has_the_target_where_the_errors_put_it(robot, chain, poses, tmp_path):
    errors = some_errors(chain) | {"tracker.lx": 1e-3, "tracker.ly": -2e-3, "tracker.lz": 5e-4}
    errors |= {f"tool.{part}": 0.0 for part in ("mis_x", "mis_y", "offset")}
    path = tmp_path / "calibrated.urdf"
    path.write_text(calibrated_urdf(robot.with_values(errors)))
    model = pin.buildModelFromUrdf(str(path))
    expected = chain.at(poses, errors).target
    np.testing.assert_allclose([placed(model, "reflector", q) for q in poses], expected, atol=1e-9)
    tracker = model.frames[model.getFrameId("tracker")].placement.translation
    np.testing.assert_allclose(tracker, [2.1 - 1e-3, -1.25 + 2e-3, 0.35 - 5e-4], atol=1e-9)


def test_a_joint_about_x_has_its_tilts_about_y_and_z(tmp_path):
    (tmp_path / "one.urdf").write_text(
        '<robot name="one"><link name="base"/><link name="arm"/><joint name="j" type="revolute"><parent link="base"/>'
        '<child link="arm"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        '<link name="ball"/><joint name="b" type="fixed"><parent link="arm"/><child link="ball"/><origin xyz="0 0 1"/>'
        "</joint></robot>"
    )
    (tmp_path / "one.yaml").write_text(
        "format: 1\nname: one\nurdf: one.urdf\ngravity: [0.0, 0.0, 0.0]\njoints: [j]\nposes: {target: ball}\n"
    )
    robot = load_robot(tmp_path / "one.yaml")
    point = ArmChain(robot.tree, "ball", np.zeros(3)).at(np.zeros((1, 1)), {})
    np.testing.assert_allclose(point.by_error["j.mis_x"], [[1.0, 0.0, 0.0]], atol=1e-12)  # about y
    np.testing.assert_allclose(point.by_error["j.mis_y"], [[0.0, 0.0, 0.0]], atol=1e-12)  # about z
    np.testing.assert_allclose(point.by_error["j.offset"], [[0.0, -1.0, 0.0]], atol=1e-12)
