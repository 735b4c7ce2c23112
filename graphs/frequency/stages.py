# SPDX-License-Identifier: BSD-3-Clause
"""From stage to stage: the arm about where it was found, what carries the excitation, and how large residuals are.

Residuals of the torque balance are what friction laws, sensors and a motion beside the excitation leave. Their
covariance at each line is that of the last stage's residuals at neighbouring lines, over all experiments: at first many
of them, then ever fewer, for a resonance at the wrong place makes a few lines look noisy, and would be left there.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.frequency.frequency_set import FrequencySet, GeometrySlopes, Stage
from jointscope.graphs.frequency.motor_effects import MotorEffects, measured_torques, motor_effects
from jointscope.graphs.frequency.motor_stiffness import MotorStiffness, motor_stiffness
from jointscope.graphs.frequency.moving_arm import moving_arm
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.responses.neighbouring_lines import NEIGHBOURS, neighbours, over_neighbours
from jointscope.robots.bodies.misplaced_joints import ANGLES, LENGTHS
from jointscope.robots.geometry.error_parameters import CUBIC, LINK_INERTIA, LINK_MASS, LINK_MOMENTS, PAYLOAD
from jointscope.robots.geometry.flexible_arm import FlexibleArm
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
LOG_FLOOR = 0.1  # sigma of a logarithm: below it the shape of friction counts, which the matrix does not hold
HARDENED = 2  # times the highest line: what a drive that hardens makes of two lines, and where it resonates under load
NARROWER = 4  # times fewer lines from stage to stage
STEP = {"length": 1e-4, "angle": 1e-4, "mass": 1e-2, "moment": 1e-3, "inertia": 1e-3}  # SI, of differences


def first_stage(robot: Robot, pose: ShakenPose) -> FrequencySet:
    """The pose with the logarithm of its matrix."""
    arm, values = FlexibleArm(robot), robot.values
    hardens = any(name.endswith(CUBIC) for name in values)
    m, pose = pose.matrix, replace(pose, reach=HARDENED if hardens else 1)
    relative = (m.sigmas(m.total) / np.maximum(np.abs(m.G), 1e-300))[pose.used]
    parts = arm.linearised(pose.q, values).mean
    sharpness = np.array([robot.sharpness_of(joint, values) for joint in arm.joints])
    stage = Stage(
        parts,
        (1.0 / np.hypot(relative, LOG_FLOOR)).astype(complex),
        0.0,
        None,
        sharpness,
        {},
        values,
        True,
        len(pose.lines),
        geometry_slopes(arm, robot, pose),
    )
    return FrequencySet(robot, pose, stage)


def next_stage(before: FrequencySet, calibration: Calibration) -> FrequencySet:
    """The pose with the torque balance about values that were found."""
    values, pose, robot, arm = before.values(calibration), before.pose, before.robot, before.arm
    width = max(before.stage.width // NARROWER, NEIGHBOURS)
    parts, sharpness = arm.linearised(pose.q, values).mean, before.sharpness(values)
    slopes = before.stage.slopes
    eye = np.broadcast_to(np.eye(len(arm.joints), dtype=complex), (len(pose.w), len(arm.joints), len(arm.joints)))
    x, needed, effects = _moving(before, values, sharpness)
    k = motor_stiffness(arm, parts, pose.w, values)
    true, columns = measured_torques(arm.joints, pose.torques, pose.w, values)
    standing = np.einsum("lij,elj->eli", k.Z, pose.motion[:, pose.lines])
    shift = np.asarray(needed[:, pose.lines] - standing - (true - pose.torques))
    sharper = pose.both_signs(effects.sharper)[:, pose.lines]
    columns |= _of_effects(before, values, k, effects)
    columns |= dict(zip(slopes.names, k.by_parts(pose.w, slopes.parts, pose.motion[:, pose.lines]), strict=True))
    stage = Stage(parts, eye, shift, pose.friction(sharpness), sharpness, columns, values, False, width, slopes)
    stage = replace(stage, x=x, sharper=sharper)
    now = FrequencySet(robot, pose, stage)
    r = now.torque_balance(values, k)
    root = np.linalg.cholesky(_covariance(r, width))
    size = 4.0 * len(r) * float(np.sum(np.log(np.einsum("lii->li", root).real)))  # real and imaginary part
    whiten = np.asarray(np.linalg.solve(root, now.with_friction(k.Z, values)), dtype=np.complex128)
    return replace(now, stage=replace(stage, whiten=whiten, unlikely=size))


def with_columns(problem: FrequencySet, robot: Robot) -> FrequencySet:
    """A pose at its last stage with columns of effects that a robot has beside, all of which do nothing yet."""
    pose, old = problem.pose, problem.stage
    assert old.x is not None
    other = FrequencySet(robot, pose, old)
    values = robot.values
    parts, sharpness = other.arm.linearised(pose.q, values).mean, other.sharpness(values)
    k = motor_stiffness(other.arm, parts, pose.w, values)
    slopes = geometry_slopes(other.arm, robot, pose, set(problem.robot.parameters))
    more = k.by_parts(pose.w, slopes.parts, pose.motion[:, pose.lines])
    columns = dict(old.geometry) | dict(zip(slopes.names, more, strict=True))
    effects = motor_effects(problem.arm, pose, values, sharpness, old.x)
    columns |= measured_torques(problem.arm.joints, pose.torques, pose.w, values)[1]
    columns |= _of_effects(problem, values, k, effects)
    return replace(other, stage=replace(old, parts=parts, geometry=columns, values=values))


def _moving(
    before: FrequencySet, values: Mapping[str, float], sharpness: Array
) -> tuple[Complex, Complex, MotorEffects]:
    """The arm's motion, torques that it needs, shape (e, K, nu), and effects on the motors."""
    pose, arm, x = before.pose, before.arm, before.stage.x
    if x is None:
        moving = moving_arm(arm, pose, values)
    else:
        known = motor_effects(arm, pose, values, sharpness, x)
        moving = moving_arm(arm, pose, values, x, known.offset, known.stiffer)
    effects = motor_effects(arm, pose, values, sharpness, moving.x)
    return moving.x, moving.torques + pose.both_signs(effects.torque), effects


def _of_effects(
    before: FrequencySet, values: Mapping[str, float], k: MotorStiffness, effects: MotorEffects
) -> dict[str, Complex]:
    """Torques by effects of unit size, shape (e, l, nu)."""
    pose, lines = before.pose, before.pose.lines
    inertias = np.array([values[f"{joint}.inertia"] for joint in before.arm.joints])
    springs = k.Z + (pose.w**2)[:, None, None] * np.diag(inertias)

    found: dict[str, Complex] = {}
    for name, (motor, offset, torque) in effects.waves.items():
        found[name] = np.zeros((len(pose.motion), len(lines), len(inertias)), dtype=complex)
        if offset is not None:
            found[name] += np.einsum("li,el->eli", springs[:, :, motor], pose.both_signs(offset)[:, lines])
        if torque is not None:
            found[name][:, :, motor] += pose.both_signs(torque)[:, lines]
    return found


def _covariance(r: Complex, width: int) -> Complex:
    """Of residuals at each line, shape (l, nu, nu), by those of its neighbours.

    The inverse of a covariance of n samples is n / (n - nu) too large in the mean, and the information with it.
    """
    each = np.einsum("eli,elj->lij", r, r.conj()) / len(r)
    mean = over_neighbours(each, width)
    count = len(r) * neighbours(r.shape[1], width)
    mean = mean * (count / np.maximum(count - r.shape[2], 1.0))[:, None, None]
    floor = 1e-6 * np.real(np.trace(mean, axis1=1, axis2=2))[:, None, None] * np.eye(r.shape[2])
    return np.asarray(mean + floor)


def geometry_slopes(arm: FlexibleArm, robot: Robot, pose: ShakenPose, known: Collection[str] = ()) -> GeometrySlopes:
    """How M, C and G follow geometric errors and errors of masses that are parameters of the robot, by differences.

    They change by thousandths where geometry does by millimetres, so one look serves all stages.
    """
    values = robot.values
    kinds = dict.fromkeys(LENGTHS, STEP["length"]) | dict.fromkeys(ANGLES, STEP["angle"])
    kinds |= {LINK_MASS: STEP["mass"], LINK_INERTIA: STEP["inertia"]} | dict.fromkeys(LINK_MOMENTS, STEP["moment"])
    steps = {f"{joint}.{part}": step for joint in robot.joints for part, step in kinds.items()} | {
        PAYLOAD: STEP["mass"]
    }
    free = [name for name in steps if name in robot.parameters and not robot.parameters[name].fixed]
    free = [name for name in free if name not in known]
    parts, shape = arm.linearised(pose.q, values).mean, (len(free), len(arm.springs), len(arm.springs))
    moved = [arm.linearised(pose.q, {**values, name: values[name] + steps[name]}).mean for name in free]
    M, C, G = (
        np.array([(each[i] - part) / steps[name] for name, each in zip(free, moved, strict=True)]).reshape(shape)
        for i, part in enumerate(parts)
    )
    return GeometrySlopes(tuple(free), (M, C, G))
