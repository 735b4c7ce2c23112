# SPDX-License-Identifier: BSD-3-Clause
"""Regression of a rigid joint's commands on its motion and on what an effect would add.

    u = (M a + c + g + b a + d v + mu sign(v) - law) / k

under smooth windows, joint by joint, see `graphs/starts/drive_regression.py`. Effects that the robot has already are
regressed on, too, each by its columns at nothing of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.regression.torque_columns import ANGLE, TURN, TorqueColumns, has_columns
from jointscope.graphs.starts.drive_regression import GAIN, INERTIA, MOST_NOISE, PLACES, VISCOUS, load_of
from jointscope.graphs.starts.drive_starts import LIMIT, PLAIN, driven_joints, parts_of
from jointscope.graphs.starts.motion_cells import mean_commands, motion_cells
from jointscope.graphs.starts.windowed_sums import PER_WINDOW, joint_signals, noise_gains, window_cells, windowed_rows
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

DELAY, DELAY_NAME = "command_delay@robot", "robot.command_delay.delay"  # commands are moved by it
FEWEST_ROWS = 60  # windows


def joint_rows(robot: Robot, recordings: Sequence[Recording]) -> JointRows | None:
    """The rows of a robot's regression; None where it does not apply, or streams do not overlap: others say so.

    Args:
        robot: the model.
        recordings: of it, at least one.
    """
    if not _applies(robot):
        return None
    try:
        return JointRows(robot.in_posture(recordings[0].posture), recordings)
    except RecordingError:
        return None


def _applies(robot: Robot) -> bool:
    """Whether all joints are rigid, with known masses, and with effects that columns tell."""
    if robot.layout.motors or robot.choices.link_dynamics != "model" or robot.transmission is not None:
        return False
    return all(has_columns(here.effect) for here in of_drives(robot) if here.label != DELAY)


def of_drives(robot: Robot) -> list[EffectAt]:
    """Effects that reach the motion of motors, or what is measured of it: not those of other sensors."""
    others = [name for name in robot.sensors if name != robot.motor_encoder.name]
    return [here for here in robot.effects if here.owner not in others]


class JointRows:
    """Windowed rows of the regression, with columns of effects.

    Args:
        robot: in the posture of the recordings.
        recordings: of it.
    """

    def __init__(self, robot: Robot, recordings: Sequence[Recording]):
        self.robot, sigmas = robot, robot.motor_encoder.sigmas
        delay = robot.parameter(DELAY_NAME).value if any(h.label == DELAY for h in robot.effects) else 0.0
        self._driven = driven = driven_joints(robot, recordings, delay)
        more = [h for h in of_drives(robot) if h.label != DELAY and h.effect.id not in (PLAIN, LIMIT)]
        self._own = [_as_it_is(robot, here) for here in more]
        cells = [motion_cells(d.encoder, d.command, sigmas, robot.command_held, d.left_out) for d in driven]
        self._plain = [joint_signals(c, load_of(robot.tree, c), robot.friction_sharpness()) for c in cells]
        self._columns = [TorqueColumns(robot, c) for c in cells]

    def with_commands(self, change: Callable[[Stream], Stream]) -> JointRows:
        """The same motion, driven by commands that are changed; which cells are known stays.

        Args:
            change: from the commands of a recording to others.
        """
        other, held = copy(self), self.robot.command_held
        other._plain, other._columns = [], []
        for driven, plain, columns in zip(self._driven, self._plain, self._columns, strict=True):
            u = mean_commands(change(driven.command), columns.cells.edges, held)
            other._plain.append(np.concatenate([u[:, :, None], plain[:, :, 1:]], axis=2))
            other._columns.append(TorqueColumns(self.robot, replace(columns.cells, u=u)))
        return other

    def of(self, joint: int, width: float, hypothesis: EffectHypothesis | None = None) -> Array | None:
        """Signals, columns of the robot's own effects and of another one under all windows, shape (w, 5 + e + k).

        None where the other one does not act, or there are too few windows.

        Args:
            joint: index.
            width: of the windows [s].
            hypothesis: the other effect.
        """
        more = [[] for _ in self._columns] if hypothesis is None else self.columns(joint, hypothesis)
        found = None if more is None else self.beside(joint, width, self.with_own(joint, more))
        return None if found is None else found[0]

    def columns(self, joint: int, hypothesis: EffectHypothesis) -> list[list[Array]] | None:
        """What an effect adds to a joint in each recording, shape (m,) each; None where it does not act there."""
        found = [columns.of(hypothesis, joint) for columns in self._columns]
        return None if any(some is None for some in found) else [some or [] for some in found]

    def constant(self) -> list[list[Array]]:
        """What a torque adds that stays, in each recording, shape (m,)."""
        return [[np.ones(len(columns.cells.times))] for columns in self._columns]

    def with_own(self, joint: int, more: Sequence[Sequence[Array]]) -> list[list[Array]]:
        """Columns of each recording behind those of the effects that the robot has."""
        pairs = zip(self._columns, more, strict=True)
        return [
            [*(own for here in self._own for own in columns.of(here, joint) or ()), *some] for columns, some in pairs
        ]

    def own_count(self, joint: int) -> int:
        """How many columns the effects have that the robot has."""
        return len(self.with_own(joint, [[] for _ in self._columns])[0])

    def times(self, recording: int) -> Array:
        """Middles of the cells of a recording, shape (m,) [s]."""
        return self._columns[recording].cells.times

    def beside(
        self, joint: int, width: float, columns: Sequence[Sequence[Array]]
    ) -> tuple[Array, NDArray[np.intp]] | None:
        """Signals of a joint and other columns under all windows, shape (w, 5 + k), and the block of each, shape (w,).

        None where there are too few windows.

        Args:
            joint: index.
            width: of the windows [s].
            columns: for each recording k of them, shape (m,).
        """
        rows, blocks, first = list[Array](), list[NDArray[np.intp]](), 0
        for plain, here, more in zip(self._plain, self._columns, columns, strict=True):
            signals = np.column_stack([plain[:, joint], *more])[:, None, :]
            for part, block, count in windowed_rows(here.alone(joint), signals, width)[0]:
                rows.append(part)
                blocks.append(block + first)
                first += count
        return (np.vstack(rows), np.concatenate(blocks)) if sum(map(len, rows)) >= FEWEST_ROWS else None

    def motions(self, joint: int) -> list[tuple[Array, Array]]:
        """Signals of a joint, shape (m, 5), and the weight that it carries, shape (m,) [N m], of each recording."""
        pairs = zip(self._plain, self._columns, strict=True)
        return [(plain[:, joint], columns.weight[:, joint]) for plain, columns in pairs]

    def seconds(self, width: float, windows: int) -> float:
        """How much motion so many windows of some width [s] tell of [s]."""
        cells = self._columns[0].cells
        together, length = window_cells(cells, width)
        return windows * max(length // PER_WINDOW, 1) * together * cells.h

    def noise(self, joint: int, width: float, found: Fit) -> float:
        """Mean square that the noise of the encoders leaves of a regression, in squares of the command.

        Args:
            joint: index.
            width: of the windows [s].
            found: the regression.
        """
        cells, sigmas = self._columns[0].cells, self.robot.motor_encoder.sigmas
        M = self.robot.tree.mass_matrix(cells.q[:1])[0, joint].copy()
        inertias = parts_of(self.robot, self.robot.joints[joint])[INERTIA]
        M[joint] += found.laws().get(INERTIA, sum(f * p.value for p, f in inertias))
        together, length = window_cells(cells, width)
        gain = noise_gains(float(cells.periods[joint]), together * length * cells.h)[1]
        return float(gain * (M**2 @ sigmas**2) / found.gain**2)

    def open_at(self, joint: int, width: float, left: float) -> bool:
        """Whether a joint lacks so much, beyond the noise of its encoder, that some cause could leave a share of it.

        Args:
            joint: index.
            width: of the windows [s].
            left: the share.
        """
        here = self.of(joint, width)
        if here is None:
            return False
        plain = fit(self.robot, joint, here)
        return left * plain.left > MOST_NOISE * self.noise(joint, width, plain)

    def positions(self, joint: int) -> list[Array]:
        """Positions of a joint in the middles of the cells of each recording, shape (m,) [rad]."""
        return [columns.cells.q[:, joint] for columns in self._columns]

    def spans(self) -> list[tuple[float, float]]:
        """First and last time of each recording [s]."""
        return [(float(c.cells.times[0]), float(c.cells.times[-1])) for c in self._columns]


@dataclass(frozen=True)
class Fit:
    """A regression with one effect, or none.

    Attributes:
        left: mean square that is left, in squares of the command.
        values: factors of load and of the signals of PLACES, in units of the command.
        more: factors of the columns beside them, shape (e + k,).
        hypothesis: the effect.
        sizes: how many it has.
    """

    left: float
    values: dict[str, float]
    more: Array
    hypothesis: EffectHypothesis | None = None
    sizes: int = 0

    @property
    def gain(self) -> float:
        """Torque of one unit of the command; 1 where that is known [N m]."""
        return 1.0 / self.values[GAIN] if self.values.get(GAIN) else 1.0

    def laws(self) -> dict[str, float]:
        """What was found, by law."""
        laws = {law: self.values[law] * self.gain for law in PLACES if law in self.values}
        return {**laws, GAIN: self.gain} if GAIN in self.values else laws


def fit(
    robot: Robot, joint: int, rows: Array, hypothesis: EffectHypothesis | None = None, free_gain: bool = False
) -> Fit:
    """The regression of commands on motion and on the columns of an effect; with a gain that is free, or as it is."""
    free, X, target = design_of(robot, joint, rows, free_gain)
    size = np.maximum(np.sqrt(np.mean(X**2, axis=0)), 1e-300)
    found = np.linalg.lstsq(X / size, target, rcond=1e-10)[0] / size
    values = dict(zip(free, found.tolist(), strict=False))
    sizes = 0 if hypothesis is None else len(hypothesis.sizes)
    return Fit(float(np.mean((target - X @ found) ** 2)), values, found[len(free) :], hypothesis, sizes)


def design_of(robot: Robot, joint: int, rows: Array, free_gain: bool = False) -> tuple[list[str], Array, Array]:
    """What is free, its columns before those of effects, shape (w, p + e + k), and what is regressed on them."""
    parts = parts_of(robot, robot.joints[joint])
    held = {law: sum(f * p.value for p, f in some) for law, some in parts.items() if all(p.fixed for p, _ in some)}
    held = {VISCOUS: 0.0, **held} if VISCOUS not in parts else held
    if GAIN not in parts:
        held[GAIN] = 1.0
    if free_gain:
        held.pop(GAIN, None)
    load = rows[:, 1] + sum((held[law] * rows[:, place] for law, place in PLACES.items() if law in held), np.zeros(1))
    free = [law for law in PLACES if law not in held]
    columns, more = [rows[:, PLACES[law]] for law in free], rows[:, 5:]
    if GAIN in held:
        return free, np.column_stack([*columns, more]), rows[:, 0] - load / held[GAIN]
    return [GAIN, *free], np.column_stack([load, *columns, more]), rows[:, 0]


def sigma_of(
    told: Callable[[Fit], float], robot: Robot, joint: int, rows: Array, blocks: NDArray[np.intp], fewest: int
) -> float | None:
    """The sigma of what a regression tells, from blocks left out in turn; None with too few."""
    names = np.unique(blocks)
    if len(names) < fewest:
        return None
    others = np.array([told(fit(robot, joint, rows[blocks != name])) for name in names])
    return float(np.sqrt((len(names) - 1.0) * np.var(others)))


def changes_between(robot: Robot, joint: str, plain: Fit, best: Fit) -> dict[str, float]:
    """By which factor each value changes from one regression to another, if it is no other joint's, by name."""
    before, after, found = plain.laws(), best.laws(), dict[str, float]()
    for law, some in parts_of(robot, joint).items():
        free = [p for p, _ in some if not p.fixed]
        if law in before and before[law] and len(some) == 1 and free and free[0].name.startswith(f"{joint}."):
            found[free[0].name] = after[law] / before[law]
    return found


def _as_it_is(robot: Robot, here: EffectAt) -> EffectHypothesis:
    """An effect that the robot has, with its shapes."""
    parameters = here.effect.parameters_at(robot, here.owner)
    shapes = {p.name: robot.parameter(here.parameter(p.name)).value for p in parameters if p.is_shape}
    if here.effect.id == TURN:
        shapes = {ANGLE: robot.parameter(here.parameter(parameters[0].name)).value}
    return EffectHypothesis(here, tuple(p for p in parameters if not p.is_shape), shapes)
