# SPDX-License-Identifier: BSD-3-Clause
"""Whether the inertias of a URDF make equations of motion: a mass matrix that is positive definite in every posture.

A body that cannot exist (principal moments of which one exceeds the sum of the other two) still has such equations.
Makers round, and fill in guesses; that is worth a remark, not a refusal. A joint that moves something negative has
none. The last joint of a branch may move nothing at all, as the fingers of many grippers: its rotor has an inertia.
Where a body carries others and has none itself, the mass matrix may be definite all the same: that is worth a remark,
as the drive's inertia takes its place. Where nothing at all has one, the file tells geometry only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError

Array = NDArray[np.float64]
POSTURES = 64  # at which the mass matrix is looked at, besides zero
SINGULAR = 1e-10  # eigenvalue of the mass matrix, scaled to a unit diagonal, that cannot be told from zero
ROUNDING = 1e-9  # of moments, over m (extent of the body)^2
NOTHING = 1e-15  # [kg m2] or [kg] of a row of the mass matrix: what rounding leaves of a body that has no inertia
SLIGHT = 1e-3  # share of the largest moment by which printed digits alone miss the inequality


def check_inertias(
    file: str, model: pin.Model, joints: Sequence[str], mass_matrix: Callable[[Array], Array], limits: Array
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Looks at the bodies behind the moving joints, each with what is fixed to it.

    Args:
        file: name of the URDF.
        model: what moves.
        joints: names in the order of the mass matrix.
        mass_matrix: M of the joints, from (m, n) to (m, n, n) [kg m^2].
        limits: of the joints, shape (n, 2).

    Returns:
        Remarks on bodies that cannot exist, and the last joints that move no inertia in any posture.

    Raises:
        RobotError: there is a posture without equations of motion.
    """
    odd = {model.names[j]: _oddity(model, j) for j in range(1, model.njoints)}
    M = mass_matrix(_postures(limits))
    carriers = {model.names[model.parents[j]] for j in range(1, model.njoints) if model.names[j] in joints}
    idle = np.abs(M).max(axis=(0, 2), initial=0.0) <= NOTHING
    idle &= [joint not in carriers for joint in joints]
    massless = tuple(joint for joint, nothing in zip(joints, idle, strict=True) if nothing)
    M = M + np.diag(idle.astype(float))
    size = np.sqrt(np.abs(np.diagonal(M, axis1=1, axis2=2)))
    scale = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(M / (scale[:, :, None] * scale[:, None, :]))
    worst = int(np.argmin(values[:, 0]))
    if values[worst, 0] > SINGULAR:
        remarks = [text for size, text in odd.values() if size > SLIGHT]
        remarks += [f"{odd[joint][1] or joint + ' moves no inertia'}; its rotor has it all" for joint in massless]
        remarks += [_without_own(model, joint) for joint in joints if joint in carriers and _has_nothing(model, joint)]
        return tuple(f"{file}: {text}" for text in remarks), massless
    joint = joints[int(np.argmax(np.abs(vectors[worst, :, 0])))]
    reason = odd[joint][1] or max(odd.values())[1] or f"{joint} moves {_links(model, model.getJointId(joint))}"
    raise RobotError(
        f"{file}: {reason}; the mass matrix is not positive definite, so {joint} has no equation of motion. Give "
        "what it moves a <mass> and an <inertia> in the URDF with positive principal moments, none above the sum of "
        f"the others, or leave {joint} out of the joints"
    )


def _has_nothing(model: pin.Model, joint: str) -> bool:
    inertia = model.inertias[model.getJointId(joint)]
    return bool(inertia.mass == 0.0 and not np.any(inertia.inertia))


def _without_own(model: pin.Model, joint: str) -> str:
    """What becomes of the inertia of a body that carries others and has none in the file, as makers leave out some."""
    return (
        f"{_links(model, model.getJointId(joint))}, moved by {joint}, has no inertia of its own; if the real one has, "
        f"what turns with {joint} is counted to {joint}.inertia, and its weight is missing: give it a <mass> and an "
        "<inertia>"
    )


def _postures(limits: Array) -> Array:
    """Zero, and postures spread over the limits, at most a turn wide, shape (m, n)."""
    low, high = np.where(np.isfinite(limits), limits, [-np.pi, np.pi]).T
    spread = np.random.default_rng(0).uniform(low, np.maximum(high, low), (POSTURES, len(limits)))
    return np.vstack([np.zeros((1, len(limits))), spread])


def _oddity(model: pin.Model, j: int) -> tuple[float, str]:
    """How far a body is from one that can exist, over its largest moment, and a sentence; zero and none if it can."""
    inertia = model.inertias[j]
    moments = np.linalg.eigvalsh(inertia.inertia)
    numbers = f"principal moments {', '.join(f'{x:.4g}' for x in moments)} kg m2, mass {inertia.mass:.4g} kg"
    body = f"{_links(model, j)}, moved by {model.names[j]},"
    largest = max(float(np.abs(moments).max()), 1e-300)
    rounding = ROUNDING * max(largest, inertia.mass * float(inertia.lever @ inertia.lever))
    excess = float(moments[2] - moments[0] - moments[1])
    if inertia.mass < 0 or moments[0] < -rounding:
        return np.inf, f"{body} has a negative inertia: {numbers}"
    if largest == 1e-300 and inertia.mass == 0.0:
        return 0.0, f"{body} has no inertia"
    if excess <= rounding:
        return 0.0, ""
    return excess / largest, (
        f"{body} cannot exist: {numbers}; the largest moment exceeds the sum of the others by "
        f"{100.0 * excess / largest:.2g} %"
    )


def _links(model: pin.Model, j: int) -> str:
    """The link behind a joint, with what is fixed to it."""
    names = [frame.name for frame in model.frames if frame.parentJoint == j]
    if len(names) < 2:
        return f"link {names[0]}" if names else "the body"
    return f"link {names[0]} (with {', '.join(names[1:4])}{' and more' if len(names) > 4 else ''})"
