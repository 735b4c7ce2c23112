# SPDX-License-Identifier: BSD-3-Clause
r"""Levels beyond which a drive gives no more than at them, whatever is commanded.

With c = clip(u, -L, L) and the excess e = u - c, a drive of which a part `lost` of the excess does nothing obeys

    k (c + (1 - lost) e) = M a + c + g + b a + d v + mu sign(v)

So c is regressed on the motion and on e: the factor of e is -(1 - lost), which is -1 where the drive gives all and 0
where it saturates at L. No torque that a model may lack makes the excess vanish just so. L is where the motion leaves
least of c open. Rotor, friction and constant are found in the same regression, so no value of a robot file is believed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.starts.drive_regression import Driven, load_of
from jointscope.graphs.starts.golden_section import golden_section
from jointscope.graphs.starts.motion_cells import MotionCells, mean_commands
from jointscope.graphs.starts.windowed_sums import SIGNALS, joint_signals, windowed_rows
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

TRIED = (0.2, 0.35, 0.5, 0.6, 0.7, 0.8, 0.88, 0.93, 0.96, 0.98, 0.99, 0.995)  # quantiles of the commands' size
BETWEEN = 9  # levels between the neighbours of the best of them, and once more
WIDTHS = (0.06, 0.12, 0.24)  # [s] of windows; the one that tells most about the excess counts
REFINED = 12  # steps of a golden section
HINT = 1.2  # times less is left open with a limit, in windows of a middle width, where others are tried
BETTER = 2.0  # times less is left open with a limit than without
OPEN = 0.01  # of the mean square of the command that may be left open where a limit is believed
LOST, SURE = 0.8, 0.06  # of the excess that must be lost, and its sigma at most
FEWEST = 8  # commands beyond a limit
FEWEST_ROWS = 60  # windows in which a joint moves; fewer are explained by anything
SEVERAL, GOOD_PART = 3, 0.02  # blocks of the recording with such a part of the excess, mean square
FAR_BETTER = 20.0  # times less must be left open where there are fewer: a push may look alike
DRY_COLUMN = SIGNALS.index("dry") - 1  # of the motion: all signals but the command
MOVES = 0.7  # of a limit that dry friction may take: a drive that gives hardly more moves nothing
PIECES = 6  # of the windows with excess that are left out one by one


@dataclass(frozen=True)
class CommandLimit:
    """What one drive gives at the most.

    Attributes:
        level: in the unit of the command.
        share: of the commands that are beyond it.
        lost: part of the excess that does nothing.
    """

    level: float
    share: float
    lost: float


def limited(command: Stream, limits: Sequence[CommandLimit | None]) -> Stream:
    """What the drives gave of a command."""
    levels = np.array([np.inf if limit is None else limit.level for limit in limits])
    return replace(command, values=np.clip(command.values, -levels, levels)) if np.isfinite(levels).any() else command


@dataclass(frozen=True)
class DrivenWindows:
    """One recording under windows of one width: motion of each joint, and what its commands need to follow."""

    cells: MotionCells
    command: Stream
    held: bool
    width: float
    motion: list[Array]
    blocks: list[NDArray[np.intp]]

    def of_command(self, joint: int, values: Array) -> Array:
        """Windowed means of a changed command of a joint, shape (w,)."""
        own = replace(self.command.channel(joint), values=values[:, None])
        means = mean_commands(own, self.cells.edges, self.held)
        alone = replace(self.cells, known=self.cells.known[:, [joint]])
        return np.asarray(windowed_rows(alone, means[:, :, None], self.width)[0][0][0][:, 0])


def command_limits(
    tree: RigidTree,
    recordings: Sequence[Driven],
    sigmas: Array,
    *,
    held: bool = True,
    sharpness: float | Array = 1e4,
) -> list[CommandLimit | None]:
    """The limit of each joint's drive; None where none shows.

    Args:
        tree: rigid bodies with masses.
        recordings: what drove the joints, and how they moved.
        sigmas: noise of the encoders, shape (n,) [rad].
        held: whether a command acts until the next one.
        sharpness: k in tanh(k v) of dry friction, of all joints or of each, shape (n,) [s/rad].
    """
    return limits_in(windows_of_drives(tree, recordings, sigmas, held=held, sharpness=sharpness), tree.n)


def limits_in(by_width: Mapping[float, list[DrivenWindows]], joints: int) -> list[CommandLimit | None]:
    """The same in the windows of `windows_of_drives`, for a number of joints."""
    return [_limit(j, {width: some for width, some in by_width.items() if some}) for j in range(joints)]


def windows_of_drives(
    tree: RigidTree,
    recordings: Sequence[Driven],
    sigmas: Array,
    *,
    held: bool = True,
    sharpness: float | Array = 1e4,
) -> dict[float, list[DrivenWindows]]:
    """The recordings under windows of each width [s]; arguments as of `command_limits`."""
    by_width: dict[float, list[DrivenWindows]] = {width: [] for width in WIDTHS}
    for driven in recordings:
        cells, of_links = driven.cells(sigmas, held)
        signals = joint_signals(cells, load_of(tree, of_links), sharpness)[:, :, 1:]
        for width in WIDTHS:
            rows, _ = windowed_rows(cells, signals, width)
            if rows:
                parts = [motion for motion, _, _ in rows], [block for _, block, _ in rows]
                by_width[width].append(DrivenWindows(cells, driven.command, held, width, *parts))
    return by_width


def _limit(joint: int, by_width: dict[float, list[DrivenWindows]]) -> CommandLimit | None:
    """The limit of one drive."""
    by_width = {w: some for w, some in by_width.items() if sum(len(x.motion[joint]) for x in some) >= FEWEST_ROWS}
    if not by_width:
        return None
    middle = by_width[sorted(by_width)[len(by_width) // 2]]
    sizes = np.abs(np.concatenate([some.command.channel(joint).values[:, 0] for some in middle]))
    grid = np.unique(np.quantile(sizes, TRIED))
    grid = grid[grid > 0.0]
    if not len(grid):
        return None
    grid = np.append(grid, sizes.max())
    level, left = _best_level(middle, joint, grid)
    whole = _left_open(middle, joint, np.inf)
    if whole < HINT * left:
        return None
    # narrow windows pass noise, wide ones lose motion: those that leave least open, where they tell what is lost
    telling = [some for some in by_width.values() if _lost(some, joint, level)[1] < SURE]
    if not telling:
        return None
    windows = min(telling, key=lambda some: _left_open(some, joint, level))
    if windows is not middle:
        level, left = _best_level(windows, joint, grid)
        whole = _left_open(windows, joint, np.inf)
    if whole < BETTER * left or left > OPEN or np.count_nonzero(sizes > level) < FEWEST:
        return None
    if dry_friction(windows, joint, [_clipped(some, joint, level) for some in windows]) > MOVES * level:
        return None
    lost, sigma, several = _lost(windows, joint, level)
    believed = lost > LOST and sigma < SURE and (several or whole > FAR_BETTER * left)
    return CommandLimit(level, float(np.mean(sizes > level)), lost) if believed else None


def _best_level(windows: list[DrivenWindows], joint: int, grid: Array) -> tuple[float, float]:
    """Where the motion leaves least of the command open, between the neighbours of the best of a grid; and how much."""
    for _ in range(2):
        found = [_left_open(windows, joint, float(level)) for level in grid]
        k = int(np.argmin(found))
        near = grid[max(k - 1, 0) : k + 2]
        grid = np.geomspace(near[0] if k else 0.5 * grid[0], near[-1], BETWEEN)
    found = [_left_open(windows, joint, float(level)) for level in grid]
    k = int(np.argmin(found))
    low, high = grid[k - 1] if k else 0.5 * grid[0], grid[min(k + 1, len(grid) - 1)]
    refined = golden_section(lambda level: _left_open(windows, joint, level), low, high, REFINED)
    best = min([*refined, (found[k], grid[k])])
    return float(best[1]), float(best[0])


def _clipped(some: DrivenWindows, joint: int, level: float) -> Array:
    return np.clip(some.command.channel(joint).values[:, 0], -level, level)


def _left_open(windows: list[DrivenWindows], joint: int, level: float) -> float:
    """What motion leaves open of a command that is limited to a level, see `left_open`."""
    return left_open(windows, joint, [_clipped(some, joint, level) for some in windows])


def left_open(windows: Sequence[DrivenWindows], joint: int, given: Sequence[Array]) -> float:
    """Share of the mean square of what a drive gave, beyond what dry friction may be, that motion does not explain.

    Where a drive always pushes in the direction of its motion, its limited command is a dry friction, the more so the
    lower the limit.

    Args:
        windows: of each recording.
        joint: index.
        given: what the drive gave instead of each command, shape (s,) for each recording.
    """
    y = np.concatenate([some.of_command(joint, values) for some, values in zip(windows, given, strict=True)])
    X = np.concatenate([some.motion[joint] for some in windows])
    if len(y) <= X.shape[1] or not y.any():
        return 1.0
    X = X / np.maximum(np.sqrt(np.mean(X**2, axis=0)), 1e-300)
    rest = y - X @ np.linalg.lstsq(X, y, rcond=1e-10)[0]
    dry = X[:, DRY_COLUMN]
    beyond = y - dry * (dry @ y) / max(float(dry @ dry), 1e-300)
    return float(rest @ rest / max(float(beyond @ beyond), 1e-300))


def dry_friction(windows: Sequence[DrivenWindows], joint: int, given: Sequence[Array]) -> float:
    """Dry friction that the motion asks for, in the unit of the command; arguments as of `left_open`."""
    y = np.concatenate([some.of_command(joint, values) for some, values in zip(windows, given, strict=True)])
    X = np.concatenate([some.motion[joint] for some in windows])
    size = np.maximum(np.sqrt(np.mean(X**2, axis=0)), 1e-300)
    return float(np.linalg.lstsq(X / size, y, rcond=1e-10)[0][DRY_COLUMN] / size[DRY_COLUMN])


def _lost(windows: list[DrivenWindows], joint: int, level: float) -> tuple[float, float, bool]:
    """Part of the excess that is lost, its sigma from leaving out pieces of it, and whether it comes several times."""
    y, e, X, blocks, first = [], [], [], [], 0
    for some in windows:
        u, c = some.command.channel(joint).values[:, 0], _clipped(some, joint, level)
        y.append(some.of_command(joint, c))
        e.append(some.of_command(joint, u - c))
        X.append(some.motion[joint])
        blocks.append(some.blocks[joint] + first)
        first = int(blocks[-1].max(initial=first)) + 1
    target, excess = np.concatenate(y), np.concatenate(e)
    where = np.flatnonzero(excess)
    if len(where) < PIECES:
        return 0.0, np.inf, False
    squares = np.bincount(np.concatenate(blocks), excess**2)
    columns = np.column_stack([excess, np.concatenate(X)])
    size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300)

    def part(without: NDArray[np.intp]) -> float:
        keep = np.ones(len(target), bool)
        keep[without] = False
        return 1.0 + float(np.linalg.lstsq((columns / size)[keep], target[keep], rcond=1e-10)[0][0] / size[0])

    others = np.array([part(piece) for piece in np.array_split(where, PIECES)])
    several = np.count_nonzero(squares > GOOD_PART * squares.sum()) >= SEVERAL
    return part(where[:0]), float(np.sqrt((PIECES - 1.0) * np.var(others))), bool(several)
