# SPDX-License-Identifier: BSD-3-Clause
"""Where a rigid joint presses against something at the end of its way: an end stop, a hose that is too short.

What a stop takes up shows nowhere else: the torque that the regression of a drive cannot place is one-signed at one
end of the motion, large there, and small on all the rest of the way. An effect of the drive does not look like this,
as it knows nothing of where the motion happens to end; a torque that depends on the position grows towards the end.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, convolve1d, find_objects, label

from jointscope.graphs.starts.drive_regression import (
    DRY,
    GAIN,
    INERTIA,
    VISCOUS,
    DriveEquation,
    Value,
    best_width,
    equations_by_width,
    load_of,
)
from jointscope.graphs.starts.drive_starts import driven_joints
from jointscope.graphs.starts.motion_cells import MotionCells, motion_cells
from jointscope.graphs.starts.windowed_sums import joint_signals, smooth_window
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

END = 0.04  # of the range that a joint used: how far a stop may give way
SET_APART = 0.08  # of the range at either end, which the regression is asked to do without
STANDS_OUT = 5.0  # times the torque that is missing on the rest of the way
ONE_SIGNED = 0.98  # of the squared torque
BEYOND_DRY = 2.0  # times the dry friction: a joint that turns over may lack as much
OF_DRIVE = 0.1  # of the rms torque of the drive
TOUCHES = 3.0  # times what is missing elsewhere, from which a visit of the end is a contact
SEVERAL = 2  # visits that end at the same place,
LONG = 0.05  # [s] or one that lasts
SAMPLES = 4.0  # of the encoder, too: one wild sample is no contact
FEWEST_CELLS = 200  # on the rest of the way


@dataclass(frozen=True)
class EndStop:
    """One end of a joint's way at which it presses against something.

    Attributes:
        joint: which.
        at: where [rad or m].
        torque: largest torque that it takes up, smoothed [N m or N].
        stretches: (t0, t1) of the contacts, with the time over which they are smeared [s].
    """

    joint: str
    at: float
    torque: float
    stretches: tuple[tuple[float, float], ...]


def end_stops(robot: Robot, recording: Recording) -> tuple[EndStop, ...]:
    """All that a recording shows, of joints without a spring between motor and link.

    Args:
        robot: says what is known; its drive parameters are not used.
        recording: one or more joints may rest in it.
    """
    rigid = [joint for joint in robot.joints if joint not in robot.layout.motors]
    if robot.free_links or not rigid:
        return ()
    posed = robot.in_posture(recording.posture)
    (driven,) = driven_joints(posed, [recording])
    sigmas = np.asarray(posed.motor_encoder.sigmas)
    try:
        cells = motion_cells(driven.encoder, driven.command, sigmas, posed.command_held, driven.left_out)
    except RecordingError:  # others say why
        return ()
    load, M = load_of(posed.tree, cells), posed.tree.mass_matrix(cells.q[:1])[0]
    sharpness = posed.friction_sharpness()
    equations = equations_by_width(_between_ends(cells), load, M, sigmas, sharpness)
    signals = joint_signals(cells, load, sharpness)
    found: list[EndStop] = []
    for j, joint in enumerate(posed.joints):
        if joint in rigid:
            found += _stops_of(joint, cells, j, signals[:, j], best_width(equations[j]))
    return tuple(found)


def _between_ends(cells: MotionCells) -> MotionCells:
    """The cells with what happened near the ends of each joint's way marked as not known."""
    low, high = np.min(cells.q, axis=0), np.max(cells.q, axis=0)
    share = (cells.q - low) / np.maximum(high - low, 1e-300)
    return replace(cells, known=cells.known & (share > SET_APART) & (share < 1.0 - SET_APART))


def _stops_of(joint: str, cells: MotionCells, j: int, signals: Array, equation: DriveEquation) -> Iterator[EndStop]:
    values = equation.solve() or {GAIN: Value(1.0, np.inf), **equation.solve({GAIN: 1.0})}
    if len(values) < 2:
        return
    plain = {law: value.value for law, value in values.items()}
    missing, width = _missing_torque(signals, plain, equation.sums.width, cells.h), equation.sums.width
    around = np.ones(2 * int(np.ceil(0.5 * width / cells.h)) + 1, bool)
    drive = plain[GAIN] * float(np.sqrt(np.mean(signals[:, 0] ** 2)))
    least = max(BEYOND_DRY * abs(plain.get(DRY, 0.0)), OF_DRIVE * abs(drive))
    q = cells.q[:, j]
    reach = END * max(float(np.ptp(q)), 1e-300)
    ends = {1.0: q > np.max(q) - reach, -1.0: q < np.min(q) + reach}
    elsewhere = cells.known[:, j] & ~binary_dilation(ends[1.0] | ends[-1.0], around)
    if np.sum(elsewhere) < FEWEST_CELLS:
        return
    usual = float(np.sqrt(np.mean(missing[elsewhere] ** 2)))
    for side, at_end in ends.items():
        contact = _contacts(at_end, side * missing > TOUCHES * usual)
        lasts = np.sum(contact) * cells.h > max(LONG, SAMPLES * cells.periods[j])
        often = label(contact)[1] >= SEVERAL
        if (often or lasts) and _is_pressed(side * missing[at_end], usual, least):
            at = float(np.average(q[contact], weights=np.abs(missing[contact])))
            pressed = float(np.max(side * missing[contact]))
            yield EndStop(joint, at, pressed, _stretches(binary_dilation(contact, around), cells))


def _missing_torque(signals: Array, values: Mapping[str, float], width: float, h: float) -> Array:
    """What drives the joint and is not used, by windows that suit the noise; zero at the edges; shape (m,) [N m]."""
    weights = [values[GAIN], -1.0, *(-values.get(law, 0.0) for law in (VISCOUS, DRY, INERTIA))]
    length = max(round(width / h), 1)
    missing = np.asarray(convolve1d(signals @ np.array(weights), smooth_window(length) / length, mode="nearest"))
    # a window that hangs over the ends of the recording averages over what nobody has seen
    half = length // 2
    missing[:half], missing[len(missing) - half :] = 0.0, 0.0
    return missing


def _contacts(at_end: Flags, pressed: Flags) -> Flags:
    """In each visit of the end all from the first to the last cell in which something is pressed, shape (m,)."""
    contact = np.zeros_like(at_end)
    for (visit,) in find_objects(label(at_end)[0]):
        cells = np.flatnonzero(pressed[visit])
        if len(cells):
            contact[visit.start + cells[0] : visit.start + cells[-1] + 1] = True
    return contact


def _is_pressed(pressing: Array, usual: float, least: float) -> bool:
    """Whether what is pressed at an end is one-signed, large, and unusual."""
    outward, square = float(np.sum(pressing[pressing > 0.0] ** 2)), float(np.sum(pressing**2))
    one_signed = outward > ONE_SIGNED * square and np.max(pressing) > least
    return bool(one_signed and square > len(pressing) * (STANDS_OUT * usual) ** 2)


def _stretches(flags: Flags, cells: MotionCells) -> tuple[tuple[float, float], ...]:
    change = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))).reshape(-1, 2)
    return tuple((float(cells.times[a] - 0.5 * cells.h), float(cells.times[b - 1] + 0.5 * cells.h)) for a, b in change)
