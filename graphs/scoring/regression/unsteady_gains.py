# SPDX-License-Identifier: BSD-3-Clause
r"""Drives whose constant is none: it falls with speed, with what they give, or as time goes by; or their friction does.

    k (1 - c s) u = M a + c + g + b a + d v + mu sign(v),      s >= 0
    k u = M a + c + g + b a + (1 - c t) (d v + mu sign(v))

with s the speed of the joint, the speed of all (a supply that sags), |u| of the drive (magnetic saturation), max(1 -
level / |u|, 0) (with a knee), |u| of all, or time (a motor that warms); lubricants that warm take friction with them.
The mean of such a gain is what a calibration takes for the constant, and it leaves so little open that residuals hardly
tell. Beside the motion, s u or t (d v + mu sign(v)) is a column of the regression; its factor is c. No effect of the
catalogue is like this.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.regression.evidence import beyond, evidence, nearly
from jointscope.graphs.scoring.regression.joint_regression import Fit, JointRows, changes_between, fit, sigma_of
from jointscope.graphs.starts.drive_regression import DRY, PLACES, VISCOUS
from jointscope.graphs.starts.windowed_sums import SIGNALS, WIDTHS

Array = NDArray[np.float64]

SPEED, SPEEDS, COMMAND, COMMANDS, TIME = "speed", "speeds", "command", "commands", "time"
FRICTION = "friction"  # that falls with time
BEYOND = "beyond"  # a level of the command
FORMS = (SPEED, COMMAND, TIME, FRICTION, SPEEDS, COMMANDS, BEYOND)  # simplest first
LEVELS = (
    0.15,
    0.3,
    0.4,
    0.5,
    0.6,
    0.7,
    0.78,
    0.85,
    0.9,
    0.94,
    0.97,
)  # quantiles of |u| tried as the level ...
FINER, NEARER = 5, 3  # ... levels between the neighbours of the best of them, and how often in all
LEFT = 0.25  # of the mean square that the plain regression leaves, which may be left where it is most clear ...
ALSO = 0.5  # ... and at the other drives; friction or loads that change leave 0.33 or more
BY_CHANCE = 1e-4  # probability that it need not be more plausible than
SURE = 4.5  # [sigma], over some 20 blocks: one joint in ten thousand by chance
SMALL = 0.01  # share of the gain that is lost at the most, below which it matters to nobody
MOST = 0.5  # share of the gain, beyond which it is something else: drives that lose more saturate
FEWEST_BLOCKS = 8
ROUNDS = 3  # in which friction is found with its fall


@dataclass(frozen=True)
class UnsteadyGain:
    """A drive whose gain, or friction, falls.

    Attributes:
        joint: whose drive.
        form: one of FORMS: with what it falls.
        lost, sigma: share of the gain, or friction, that is lost where that is largest.
        explained: share of the mean square that the plain regression leaves beyond the noise of the encoders.
        with_it: parameters of the joint with it over those without, by name; the constant is that without loss.
        evidence: for it, at its joint.
        nearly: how much less of it another cause there may have that is as good.
        level: beyond which it falls, in the unit of the command; zero where it falls from nothing on.
    """

    joint: str
    form: str
    lost: float
    sigma: float
    explained: float
    with_it: dict[str, float]
    evidence: float
    nearly: float
    level: float = 0.0


def unsteady_gains(rows: JointRows) -> tuple[UnsteadyGain, ...]:
    """The drives whose gain surely falls, all with the same; nothing where a drive would need another reason.

    Args:
        rows: of the regression.
    """
    found = {form: [one for j in range(rows.robot.n) if (one := _of(rows, j, form)) is not None] for form in FORMS}
    some = {form: gains for form, gains in found.items() if any(map(_is_clear, gains))}
    if not some:
        return ()
    worth = {form: sum(one.evidence for one in gains) for form, gains in some.items()}
    clearest = max(worth, key=lambda form: worth[form])
    least = worth[clearest] - max(one.nearly for one in some[clearest])
    as_good = [form for form in some if worth[form] >= least]
    form = max(as_good, key=lambda name: (len(found[name]), -FORMS.index(name)))
    return tuple(found[form])


def _is_clear(one: UnsteadyGain) -> bool:
    return one.explained >= 1.0 - LEFT and one.evidence > -np.log(BY_CHANCE)


def _of(rows: JointRows, joint: int, form: str) -> UnsteadyGain | None:
    """What is clearest of one drive; None where nothing is."""
    if form in (SPEEDS, COMMANDS) and rows.robot.n == 1:  # the same as those of one
        return None
    if form != BEYOND:
        return _with(rows, joint, form, 0.0, 1)
    sizes = np.concatenate([np.abs(signals[:, SIGNALS.index("command")]) for signals, _ in rows.motions(joint)])
    levels, found = np.quantile(sizes, LEVELS), list[UnsteadyGain]()
    for _ in range(NEARER):
        told = [(level, _with(rows, joint, form, float(level), 2)) for level in levels if level > 0.0]
        found += [one for _, one in told if one is not None]
        best = max(found, key=lambda one: one.evidence, default=None)
        if best is None:
            return None
        k = int(np.argmin(np.abs(levels - best.level)))
        levels = np.linspace(levels[max(k - 1, 0)], levels[min(k + 1, len(levels) - 1)], FINER + 2)[1:-1]
    assert best is not None
    return replace(best, evidence=best.evidence - float(np.log(len(LEVELS))))


def _with(rows: JointRows, joint: int, form: str, level: float, sizes: int) -> UnsteadyGain | None:
    """What the windows in which it is clearest say of one drive; None where they say nothing."""
    scales = [_scale(rows, i, joint, form, level) for i in range(len(rows.motions(joint)))]
    most = max(float(np.max(scale)) for scale in scales)
    told = [one for width in WIDTHS if (one := _under(rows, joint, width, form, scales)) is not None]
    if not told or most <= 0.0:
        return None
    clearest = min(told, key=lambda one: one.best.left / max(one.plain.left, 1e-300))
    plain, best, sigma = clearest.plain, clearest.best, clearest.sigma
    open_with, open_without = beyond(best.left, plain.left, clearest.noise)
    factor, left = float(best.more[-1]), open_with / max(open_without, 1e-300)
    lost = factor * most
    if left > ALSO or factor < SURE * sigma or not SMALL < lost < MOST:
        return None
    name = rows.robot.joints[joint]
    changes = changes_between(rows.robot, name, plain, best)
    if min(changes.values(), default=1.0) <= 0.0:  # a constant of that sign is none
        return None
    worth, near = evidence(plain.left, best.left, clearest.seconds, sizes), nearly(clearest.seconds)
    return UnsteadyGain(name, form, lost, sigma * most, 1.0 - left, changes, worth, near, level)


def _scale(rows: JointRows, recording: int, joint: int, form: str, level: float) -> Array:
    """What a gain may fall with, shape (m,)."""
    signals = [rows.motions(j)[recording][0] for j in range(rows.robot.n)]
    of = SIGNALS.index("viscous" if form in (SPEED, SPEEDS) else "command")
    if form in (TIME, FRICTION):
        return np.linspace(0.0, 1.0, len(signals[joint]))
    if form == BEYOND:
        return np.asarray(np.maximum(1.0 - level / np.maximum(np.abs(signals[joint][:, of]), 1e-300), 0.0))
    if form in (SPEED, COMMAND):
        return np.abs(signals[joint][:, of])
    sizes = [np.abs(one[:, of]) for one in signals]
    if form == COMMANDS:  # as shares of the largest: drives differ
        sizes = [size / max(float(size.max()), 1e-300) for size in sizes]
    return np.asarray(np.sum(sizes, axis=0))


class _Told(NamedTuple):
    """Regressions without and with it in windows of one width, and the sigma of its factor."""

    plain: Fit
    best: Fit
    sigma: float
    noise: float
    seconds: float


def _under(rows: JointRows, joint: int, width: float, form: str, scales: list[Array]) -> _Told | None:
    """What windows of one width [s] say; None where there are too few."""
    without = rows.beside(joint, width, rows.with_own(joint, [[] for _ in scales]))
    if without is None:
        return None
    plain = best = fit(rows.robot, joint, without[0])
    for _ in range(ROUNDS if form == FRICTION else 1):
        falling = [_falling(signals, best, form) for signals, _ in rows.motions(joint)]
        columns = [[scale * what] for scale, what in zip(scales, falling, strict=True)]
        beside = rows.beside(joint, width, rows.with_own(joint, columns))
        assert beside is not None
        here, blocks = beside
        best = fit(rows.robot, joint, here)
    sigma = sigma_of(lambda found: float(found.more[-1]), rows.robot, joint, here, blocks, FEWEST_BLOCKS)
    if sigma is None:
        return None
    return _Told(plain, best, sigma, rows.noise(joint, width, best), rows.seconds(width, len(here)))


def _falling(signals: Array, found: Fit, form: str) -> Array:
    """What is lost where all of it is, in units of the command, shape (m,)."""
    if form != FRICTION:
        return np.asarray(signals[:, SIGNALS.index("command")])
    laws = found.laws()
    return np.asarray(-sum(laws.get(law, 0.0) * signals[:, PLACES[law]] for law in (VISCOUS, DRY)) / found.gain)
