# SPDX-License-Identifier: BSD-3-Clause
"""The robot in 3D: links, joint axes, the end effector's trail and the 2 sigma ellipsoid of its position."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from jointscope.graphs.calibration.calibration_result import BagFit
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.model.robot import Robot
from jointscope.tools.presentation.tip_ellipsoid import position_jacobian, tip_covariance
from jointscope.tools.rerun_log.entities.columns import JOINT_COLOURS, WHITE, thinned, time_column
from jointscope.tools.rerun_log.entities.viewer_text import entity, viewer_text

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

Array = NDArray[np.float64]

FRAMES = 50.0  # [1/s]
VISIBLE = 0.06  # [m] half axis that an ellipsoid should have to be seen
FLATTEST = 2e-3  # [m] an ellipsoid without thickness would not be drawn


def send_estimate(
    stream: rr.RecordingStream,
    robot: Robot,
    times: Array,
    q: Array,
    covariance: Array,
    magnified: float | None = None,
) -> float:
    """The robot as a filter sees it, with the full covariance of its pose.

    Args:
        stream: where to.
        robot: the model.
        times: shape (m,) [s].
        q: link coordinates, hinges of soft bearings included, shape (m, n_link) [rad].
        covariance: of q, shape (m, n_link, n_link) [rad^2].
        magnified: of the ellipsoid; None chooses a power of ten.

    Returns:
        The magnification.
    """
    tree, tip = robot.kinematic_tree, robot.tree.bodies[-1]
    send_bodies(stream, robot, times, q, "", tree)
    _, p_base_tip = tree.body_poses(tip, q)
    _send_trail(stream, times, p_base_tip, "")
    of_tip = tip_covariance(robot, q, covariance)
    if magnified is None:
        magnified = _readable(2.0 * np.sqrt(float(np.median(np.linalg.eigvalsh(of_tip)[:, -1]))))
    return _send_ellipsoid(stream, times, p_base_tip, of_tip, "", magnified)


def _readable(half_axis: float) -> float:
    """Magnification 1, 2 or 5 times a power of ten that makes a half axis [m] about twice VISIBLE."""
    if not half_axis > 0.0:
        return 1.0
    wanted = 2.0 * VISIBLE / half_axis
    steps = [m * 10.0 ** np.floor(np.log10(wanted)) for m in (1.0, 2.0, 5.0)]
    return max(max(step for step in steps if step <= wanted * 1.001), 1.0)


def send_robot(stream: rr.RecordingStream, robot: Robot, fit: BagFit, root: str) -> None:
    """Entities robot/BODY, robot/trail and robot/position_2_sigma below `root`."""
    robot = robot.in_posture(fit.recording.posture)
    duration = float(fit.ticks[-1] - fit.ticks[0])
    keep = thinned(len(fit.ticks), max(int(FRAMES * duration), 2))
    times, q = fit.ticks[keep], fit.states[keep][:, robot.layout.joint_q]
    sigma_q = fit.sigmas[keep][:, robot.layout.joint_q]
    tip = robot.tree.bodies[-1]
    send_bodies(stream, robot, times, q, root)
    _, p_base_tip = robot.tree.body_poses(tip, q)
    _send_trail(stream, times, p_base_tip, root)
    _send_ellipsoid(stream, times, p_base_tip, position_covariance(robot.tree, tip, q, sigma_q), root)


def robot_view(robot: Robot, root: str) -> rrb.Spatial3DView:
    """The 3D view, seen obliquely so that no joint axis points at the eye."""
    import rerun.blueprint as rrb

    rest = np.vstack([robot.tree.body_poses(body, np.zeros((1, robot.n)))[1] for body in robot.tree.bodies])
    size = max(float(np.ptp(rest, axis=0).max()), 0.5)
    middle = 0.5 * (rest.min(axis=0) + rest.max(axis=0))
    eye = rrb.EyeControls3D(position=middle + size * np.array([1.0, -0.66, 0.3]), look_target=middle)
    return rrb.Spatial3DView(origin="/" + entity(root, "robot"), name="robot in 3D", eye_controls=eye)


def position_covariance(tree: RigidTree, body: str, q: Array, sigma_q: Array) -> Array:
    """Covariance of a body's position J diag(sigma_q^2) J', J by central differences.

    Args:
        tree: rigid bodies.
        body: name of the link.
        q: positions, shape (m, n) [rad].
        sigma_q: standard deviations, shape (m, n) [rad].

    Returns:
        Shape (m, 3, 3) [m^2], in the base frame.
    """
    spread = position_jacobian(tree, body, q) * sigma_q[:, None, :]
    return spread @ spread.transpose(0, 2, 1)


def send_bodies(
    stream: rr.RecordingStream, robot: Robot, times: Array, q: Array, root: str, moving: RigidTree | None = None
) -> None:
    """Entities robot/BODY below `root`: the links at angles of shape (m, n) [rad], with rods and joint axes.

    Rods and drums are those at rest, moved with the poses of `moving`, which may have further hinges.
    """
    import rerun as rr

    tree, moving = robot.tree, moving or robot.tree
    stream.log(entity(root, "robot"), rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    zero = np.zeros((1, tree.n))
    rest = {body: tree.body_poses(body, zero) for body in tree.bodies}
    for k, body in enumerate(tree.bodies):
        R, p = moving.body_poses(body, q)
        quaternions = Rotation.from_matrix(R).as_quat()
        stream.send_columns(
            entity(root, "robot", body),
            [time_column(times)],
            rr.Transform3D.columns(translation=p, quaternion=quaternions),
        )
        if k + 1 < len(tree.bodies):
            R_base_body, p_body = rest[body][0][0], rest[body][1][0]
            to_next = R_base_body.T @ (rest[tree.bodies[k + 1]][1][0] - p_body)
            if np.linalg.norm(to_next) > 1e-6:
                rod = rr.LineStrips3D([[np.zeros(3), to_next]], radii=0.025, colors=[WHITE])
                stream.log(entity(root, "robot", body, "rod"), rod, static=True)
        else:
            reach = float(np.linalg.norm(rest[body][1][0] - rest[tree.bodies[k - 1]][1][0])) or 0.25
            ball = rr.Ellipsoids3D(half_sizes=[[0.2 * reach] * 3], colors=[(*WHITE, 90)], fill_mode="majorwireframe")
            stream.log(entity(root, "robot", body, "tip"), ball, static=True)
    _send_axes(stream, robot, root)


def _send_axes(stream: rr.RecordingStream, robot: Robot, root: str) -> None:
    """A drum and an arrow along each joint axis, in the frame of the first body that the joint moves."""
    import rerun as rr

    for i, joint in enumerate(robot.joints):
        body, axis = _axis(robot.tree, i)
        radius = 0.15 - 0.03 * min(i, 3)
        turn, _ = Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])
        drum = rr.Cylinders3D(
            lengths=[0.24],
            radii=[radius],
            quaternions=[rr.Quaternion(xyzw=turn.as_quat())],
            colors=[(*JOINT_COLOURS[i % 6], 200)],
            fill_mode="solid",
        )
        arrow = rr.Arrows3D(origins=[-0.3 * axis], vectors=[0.6 * axis], colors=[JOINT_COLOURS[i % 6]], radii=0.008)
        label = rr.Points3D([0.36 * axis], radii=0.004, colors=[JOINT_COLOURS[i % 6]], labels=[viewer_text(joint)])
        stream.log(entity(root, "robot", body, f"{joint}_name"), label, static=True)
        stream.log(entity(root, "robot", body, f"{joint}_drum"), drum, static=True)
        stream.log(entity(root, "robot", body, f"{joint}_axis"), arrow, static=True)


def _axis(tree: RigidTree, joint: int) -> tuple[str, Array]:
    """The first body that a joint turns, and the joint's axis in that body's frame."""
    for body in tree.bodies:
        _, _, d_dv = tree.body_rate(body, np.zeros((1, tree.n)), np.zeros((1, tree.n)))
        axis = d_dv[0, :, joint]
        if np.linalg.norm(axis) > 1e-9:
            return body, axis / np.linalg.norm(axis)
    return tree.bodies[-1], np.array([0.0, 0.0, 1.0])  # a prismatic joint turns nothing


def _send_trail(stream: rr.RecordingStream, times: Array, p: Array, root: str) -> None:
    """The whole path faintly, and its last second brightly."""
    import rerun as rr

    path = rr.LineStrips3D([p], colors=[(110, 120, 130)], radii=0.002)
    stream.log(entity(root, "robot", "trail", "whole"), path, static=True)
    last = max(int(FRAMES), 1)
    strips = [p[max(k - last, 0) : k + 1] for k in range(len(p))]
    stream.send_columns(
        entity(root, "robot", "trail", "last_second"),
        [time_column(times)],
        rr.LineStrips3D.columns(strips=strips, colors=[(230, 190, 70)] * len(p), radii=[0.006] * len(p)),
    )


def _send_ellipsoid(
    stream: rr.RecordingStream, times: Array, p: Array, covariance: Array, root: str, magnified: float | None = None
) -> float:
    """The 2 sigma ellipsoid, magnified by a power of ten that its label names; returns the magnification."""
    import rerun as rr

    variances, axes = np.linalg.eigh(covariance)
    axes[np.linalg.det(axes) < 0.0, :, 0] *= -1.0
    half = 2.0 * np.sqrt(np.maximum(variances, 0.0))
    largest = float(np.median(half[:, -1]))
    if magnified is None:
        magnified = 10.0 ** max(round(np.log10(VISIBLE / largest)), 0) if largest > 0.0 else 1.0
    path, m = entity(root, "robot", "position_2_sigma"), len(p)
    stream.send_columns(
        path,
        [time_column(times)],
        rr.Ellipsoids3D.columns(
            half_sizes=np.maximum(magnified * half, FLATTEST),
            centers=p,
            quaternions=Rotation.from_matrix(axes).as_quat(),
            colors=[(240, 110, 170, 160)] * m,
            labels=[f"2 sigma × {magnified:g}" if magnified > 1 else "2 sigma"] * m,
        ),
    )
    stream.log(path, rr.Ellipsoids3D.from_fields(fill_mode="solid", show_labels=True), static=True)
    return magnified
