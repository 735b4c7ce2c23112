# SPDX-License-Identifier: BSD-3-Clause
"""How the lags of encoders with play follow the motion over steps.

    z1 = clip(z0 + q1 - q0, -h, h)            z = q - reading without noise, h = half of the play

On contact z1 = +-h: what came before is forgotten. Within the play dz1/dz0 = dz1/dq1 = 1: the reading stands still.
The corners of clip are rounded over a small part of the encoder's noise, by pieces of parabolas. They end where they
end: a corner with tails would let the lag creep at rest, a little in each step, by more the shorter the steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.effect_kinds.lagging_reading import LaggingReading
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

CORNER = 0.2  # [sigma of the encoder] over which a corner is rounded, to either side


@dataclass(frozen=True)
class EncoderPlays:
    """All encoders of a robot that have play.

    Attributes:
        lags: columns of their lags in a state, shape (k,).
        positions: columns of what they measure, shape (k,).
        rows: rows of the lags among the rates of a state, shape (k,).
        corners: over which clip is rounded, shape (k,) [rad].
        widths: full names of the sizes h.
        seats: sensor and channel of each.
    """

    lags: NDArray[np.intp]
    positions: NDArray[np.intp]
    rows: NDArray[np.intp]
    corners: Array
    widths: tuple[str, ...]
    seats: tuple[tuple[str, int], ...]

    @staticmethod
    def of(robot: Robot, but: Sequence[str] = ()) -> EncoderPlays | None:
        """None where no encoder has play but those whose labels are left out."""
        layout, found = robot.layout, []
        for here in robot.effects:
            effect, owner = here.effect, here.owner
            if isinstance(effect, LaggingReading) and here.label not in but:
                j, on_link = robot.joints.index(owner.removesuffix(LINK_SIDE)), owner.endswith(LINK_SIDE)
                position = (layout.joint_q if on_link else layout.motor_q)[j]
                encoder = robot.link_encoder if on_link else robot.motor_encoder
                assert encoder is not None
                place, corner = layout.memories.index(here.label), CORNER * effect.noise_of(robot, owner)
                found.append((place, int(position), corner, here.parameter(effect.width), (encoder.name, j)))
        if not found:
            return None
        index, positions, corners, widths, seats = zip(*found, strict=True)
        places = np.array(index, dtype=np.intp)
        rows = layout.n_link + layout.n_motor + places
        lags = layout.memory.start + places
        return EncoderPlays(lags, np.array(positions, np.intp), rows, np.array(corners), widths, seats)

    def sizes(self, values: Mapping[str, float]) -> Array:
        """Half of each play, shape (k,) [rad], from values by full name."""
        return np.array([values[name] for name in self.widths])

    def after(self, x0: Array, x1: Array, h: Array) -> Array:
        """Lags at the end of steps.

        Args:
            x0: states where they begin, shape (..., d).
            x1: states where they end, of which the lags are not read, shape (..., d).
            h: half of each play, shape (k,) [rad].

        Returns:
            Shape (..., k) [rad].
        """
        return clipped(self._moved(x0, x1), h, self.corners)

    def with_slopes(self, x0: Array, x1: Array, h: Array) -> tuple[Array, Array, Array]:
        """Lags at the end, their derivatives by z0 + q1 - q0 (1 within the play, 0 on contact), and by h."""
        moved = self._moved(x0, x1)
        upper, lower = _corner_slope(moved - h, self.corners), _corner_slope(-moved - h, self.corners)
        return clipped(moved, h, self.corners), 1.0 - upper - lower, upper - lower

    def along(self, x: Array, values: Mapping[str, float]) -> Array:
        """States with lags that follow their positions; what they are at the first tick stays, shape (m, d).

        Args:
            x: states, shape (m, d).
            values: parameters by full name.
        """
        filled = x.copy()
        places = zip(self.lags, self.positions, self.sizes(values).tolist(), self.corners.tolist(), strict=True)
        for lag, q, h, corner in places:
            z, found = float(x[0, lag]), []
            for moved in np.diff(x[:, q], prepend=x[:1, q]).tolist():
                z = _clipped_one(z + moved, h, corner)
                found.append(z)
            filled[1:, lag] = found[1:]
        return filled

    def unlagged(self, x: Array, values: Mapping[str, float]) -> Array:
        """States that were found without play, whose positions are about what the encoders read, as those with it.

        Args:
            x: states, shape (m, d); their lags are not read.
            values: parameters by full name.

        Returns:
            Positions ahead of the readings by the lags that followed them, and lags that follow these, shape (m, d).
        """
        x = x.copy()
        x[:, self.lags] = 0.0
        x[:, self.positions] += self.along(x, values)[:, self.lags]
        return self.along(x, values)

    def _moved(self, x0: Array, x1: Array) -> Array:
        return np.asarray(x0[..., self.lags] + x1[..., self.positions] - x0[..., self.positions])


def clipped(moved: Array, h: Array | float, corner: Array | float) -> Array:
    """clip(moved, -h, h) with rounded corners; exactly zero where h is.

    Args:
        moved: shape (..., k) [rad].
        h: shape (k,) [rad].
        corner: how far each corner reaches, shape (k,) [rad].
    """
    found = moved - _beyond(moved - h, corner) + _beyond(-moved - h, corner)
    return np.where(np.asarray(h) == 0.0, 0.0, found)  # not what rounding leaves of it


def _clipped_one(moved: float, h: float, corner: float) -> float:
    """The same for one number."""
    if h == 0.0:
        return 0.0
    if abs(moved) < h - corner:
        return moved
    upper, lower = moved - h, -moved - h
    above = upper if upper > corner else max(upper + corner, 0.0) ** 2 / (4.0 * corner)
    below = lower if lower > corner else max(lower + corner, 0.0) ** 2 / (4.0 * corner)
    return moved - above + below


def unlagged(robot: Robot, x: Array, values: Mapping[str, float] | None = None, known: Sequence[str] = ()) -> Array:
    """The same of a robot whose encoders may have play; x as it is where none has.

    Args:
        robot: with the sizes of its plays.
        x: states in its layout, shape (m, d).
        values: other values than the robot's, by full name.
        known: labels of plays whose lags are in the states already.
    """
    plays = EncoderPlays.of(robot, known)
    return x if plays is None else plays.unlagged(x, robot.values | dict(values or {}))


def _beyond(e: Array, corner: Array | float) -> Array:
    """max(e, 0), rounded."""
    return np.where(e > corner, e, np.maximum(e + corner, 0.0) ** 2 / (4.0 * corner))


def _corner_slope(e: Array, corner: Array | float) -> Array:
    """Derivative of `_beyond`."""
    return np.clip((e + corner) / (2.0 * corner), 0.0, 1.0)
