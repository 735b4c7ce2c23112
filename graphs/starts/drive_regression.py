# SPDX-License-Identifier: BSD-3-Clause
"""Torque constant, rotor inertia, dry and viscous friction of every drive by linear regression on windowed signals.

With rigid joints and known masses the equation of motion is linear in what is wanted:

    M a + c + g = k u - d v - mu sign(v) - b a

Commands are known exactly, motion nearly so, and what the model lacks is torque. So the command is regressed on the
motion, k u = (M a + c + g) + b a + d v + mu sign(v), divided by k; a known k needs no dividing. Sigmas come from
leaving out one block of time after the other, so they hold for errors that last.

Behind springs the links move otherwise than their motors: where encoders see them, M a + c + g is of their motion, and
the equation holds whatever the springs are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.starts.motion_cells import MotionCells, motion_cells, on_links
from jointscope.graphs.starts.windowed_sums import WIDTHS, WindowedSums, joint_signals, windowed_sums
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

GAIN, VISCOUS, DRY, INERTIA = "gain", "viscous", "dry", "inertia"
PLACES = {VISCOUS: 2, DRY: 3, INERTIA: 4}  # among the signals
FEWEST_BLOCKS = 5  # one more than there are values
LUCK = 1.5  # [sigma] by which a doubt that few blocks tell may be too small
SEPARATE = 1e-7  # share of the load that is not like the other signals, below which k cannot be told from them
IMPOSSIBLE = 3.5  # [sigma] below zero from which a value cannot be
MOST_NOISE = 0.5  # of a signal's mean square that may be taken off as noise of the encoder


class Value(NamedTuple):
    """A value and its standard deviation."""

    value: float
    sigma: float


def is_impossible(found: Mapping[str, Value]) -> bool:
    """Whether an inertia or a friction among the values of a drive is surely below zero."""
    return any(v.value < -IMPOSSIBLE * v.sigma for law, v in found.items() if law in PLACES)


class Links(NamedTuple):
    """What encoders on the links saw: positions from zero [rad], and their noise, shape (n,) [rad]."""

    encoder: Stream
    sigmas: Array


class Driven(NamedTuple):
    """What of one recording tells about drives.

    Attributes:
        encoder: positions from zero [rad].
        command: what drives the joints.
        left_out: stretches of time in which something else acted [s].
        links: positions of links that springs let move otherwise than their motors; None where they move alike.
    """

    encoder: Stream
    command: Stream
    left_out: Sequence[tuple[float, float]] = ()
    links: Links | None = None

    def cells(self, sigmas: Array, held: bool) -> tuple[MotionCells, MotionCells]:
        """Motion of the motors, whose encoders have some noise, shape (n,) [rad], and of the links."""
        cells = motion_cells(self.encoder, self.command, sigmas, held, self.left_out)
        if self.links is None:
            return cells, cells
        of_links = on_links(cells, *self.links)
        return replace(cells, known=of_links.known), of_links


@dataclass(frozen=True)
class DriveEquation:
    """The windowed equation of motion of one joint's drive.

    Attributes:
        sums: of products of its signals.
        rms: of the signals before windows, shape (5,).
    """

    sums: WindowedSums
    rms: Array

    def solve(self, known: Mapping[str, float] | None = None) -> dict[str, Value]:
        """Values with sigmas of all that is not known; empty where the recording cannot tell.

        Args:
            known: values of "gain" [N m per unit of command], "viscous" [N m s/rad], "dry" [N m] or "inertia" [kg m2].
        """
        given = dict(known or {})
        wanted = [name for name in PLACES if name not in given and self.rms[PLACES[name]] > 0.0]
        combine = _combination(given, wanted)
        names = wanted if GAIN in given else [GAIN, *wanted]
        blocks = len(self.sums.counts)
        if blocks < FEWEST_BLOCKS or not names or self.rms[0] == 0.0:
            return {}
        if GAIN not in given and not _tells_first(combine.T @ self.sums.total @ combine):
            return {}
        total, count, noise = self.sums.total, float(self.sums.counts.sum()), self._noise()

        def values(products: Array, windows: Array | float) -> Array:
            found = _least_squares(combine.T @ (products - np.multiply.outer(windows, noise)) @ combine)
            if GAIN in given:
                return found
            # an inverse constant of exactly zero is a constant beyond all numbers
            inverse = np.where(found[..., :1] == 0.0, 1e-99, found[..., :1])
            return np.concatenate([1.0 / inverse, found[..., 1:] / inverse], axis=-1)

        best = values(total, count)
        others = values(total - self.sums.products, count - self.sums.counts)
        # few blocks tell less than they seem to: some of their freedom is in the values
        few = (blocks - 1.0) / max(blocks - len(names), 1.0)
        spread = np.sum((others - others.mean(axis=0)) ** 2, axis=0)
        sigmas = np.sqrt(few * (blocks - 1.0) / blocks * spread)
        return {n: Value(float(x), float(s)) for n, x, s in zip(names, best, sigmas, strict=True)}

    def _noise(self) -> Array:
        """Part of the products of one window that is noise, as far as that can be believed, shape (5, 5)."""
        noise, mean = self.sums.noise, self.sums.total / max(float(self.sums.counts.sum()), 1.0)
        worst = float(np.max(np.diag(noise) / _positive(np.diag(mean))))
        return np.asarray(noise * min(1.0, MOST_NOISE / max(worst, 1e-300)))

    @property
    def carries_nothing(self) -> bool:
        """Whether the bodies ask for no torque at all: values are then known up to a common factor."""
        return bool(self.rms[1] == 0.0)

    def missing(self, values: Mapping[str, float]) -> float:
        """Rms of the torque that is missing with given values, in the windows [N m]; all that are left out are zero."""
        weights = np.array([values[GAIN], -1.0, *(-values.get(name, 0.0) for name in PLACES)])
        square = float(weights @ self.sums.total @ weights) / max(float(self.sums.counts.sum()), 1.0)
        return float(np.sqrt(max(square, 0.0)))

    def torque(self, gain: float) -> float:
        """Rms of the driving torque in the windows [N m]."""
        return float(abs(gain) * np.sqrt(self.sums.total[0, 0] / max(float(self.sums.counts.sum()), 1.0)))

    def direction(self) -> Value:
        """Whether the command turns the joint forwards (above zero), with its sigma.

        The command is regressed on load (acceleration where nothing is carried), speed and direction, all of which it
        drives in its own direction.
        """
        load = PLACES[INERTIA] if self.carries_nothing else 1
        some = [place for place in (load, 2, 3) if self.rms[place] > 0.0]
        if len(self.sums.counts) < FEWEST_BLOCKS or self.rms[0] == 0.0 or not some:
            return Value(1.0, np.inf)
        combine = np.eye(5)[:, [0, *some]] / np.sqrt(_positive(np.diag(self.sums.total)[[0, *some]]))
        total = self.sums.total
        others = _least_squares(combine.T @ (total - self.sums.products) @ combine).sum(axis=1)
        best = float(_least_squares(combine.T @ total @ combine).sum())
        return Value(best, float(np.sqrt((len(others) - 1.0) * np.var(others))))


def drive_equations(
    tree: RigidTree,
    recordings: Sequence[Driven],
    sigmas: Array,
    *,
    held: bool = True,
    sharpness: float | Array = 1e4,
) -> list[DriveEquation]:
    """The equation of each joint, each with the windows that suit it.

    Args:
        tree: rigid bodies with masses.
        recordings: what drove the joints, and how they moved.
        sigmas: noise of the encoders, shape (n,) [rad].
        held: whether a command acts until the next one.
        sharpness: k in tanh(k v), which stands for sign(v), of all joints or of each, shape (n,) [s/rad].
    """
    found: list[dict[float, DriveEquation]] = []
    for driven in recordings:
        cells, of_links = driven.cells(sigmas, held)
        M, links = tree.mass_matrix(of_links.q[:1])[0], driven.links
        now = equations_by_width(cells, load_of(tree, of_links), M, sigmas, sharpness, links)
        merged = (
            [{w: _both(a, b[w]) for w, a in old.items()} for old, b in zip(found, now, strict=True)] if found else now
        )
        found = merged
    return [best_width(equations) for equations in found]


def load_of(tree: RigidTree, cells: MotionCells) -> Array:
    """Torques M a + c + g of the cells, shape (m, n) [N m]."""
    v = 0.5 * (cells.v_smooth[1:] + cells.v_smooth[:-1])
    return tree.torque(cells.q, v if tree.coriolis else np.zeros_like(v), cells.a)


def equations_by_width(
    cells: MotionCells, load: Array, M: Array, sigmas: Array, sharpness: float | Array, links: Links | None = None
) -> list[dict[float, DriveEquation]]:
    """For each joint its equation by width of the windows [s].

    Args:
        cells: motion and commands.
        load: torques of the bodies, shape (m, n) [N m].
        M: mass matrix at some posture, which tells what noise of accelerations becomes, shape (n, n) [kg m2].
        sigmas: noise of the encoders, shape (n,) [rad].
        sharpness: k in tanh(k v) [s/rad].
        links: whose motion the load is of, if it is not that of the motors.
    """
    signals = joint_signals(cells, load, sharpness)
    rms = np.sqrt(np.mean(signals**2, axis=0))
    noise = np.column_stack([M**2 @ sigmas**2, np.diag(M) * sigmas**2, sigmas**2])
    if links is not None:  # which have noise of their own, as many times of it as they are sampled more seldom
        noise[:, 0] = M**2 @ (links.sigmas**2 * links.encoder.periods) / cells.periods
        noise[:, 1] = 0.0
    by_width = [windowed_sums(cells, signals, noise, width) for width in WIDTHS]
    return [
        {width: DriveEquation(sums[j], rms[j]) for width, sums in zip(WIDTHS, by_width, strict=True)}
        for j in range(len(rms))
    ]


def best_width(equations: Mapping[float, DriveEquation]) -> DriveEquation:
    """The equation whose windows leave the least doubt about torques: narrow ones pass noise, wide ones lose motion."""
    doubts = {width: _doubt(equation) for width, equation in equations.items()}
    return equations[min(doubts, key=lambda width: doubts[width])]


def _doubt(equation: DriveEquation) -> float:
    """Size of the torques that the sigmas of the values stand for, over the command's; infinite without an answer."""
    found = equation.solve() or {GAIN: Value(1.0, 0.0), **equation.solve({GAIN: 1.0})}
    gain = found[GAIN]
    if gain.value == 0.0 or len(found) < 2:
        return np.inf
    torques = [found[name].sigma * equation.rms[place] for name, place in PLACES.items() if name in found]
    square = (gain.sigma / gain.value) ** 2 + sum((t / (gain.value * equation.rms[0])) ** 2 for t in torques)
    luck = 1.0 + LUCK / np.sqrt(2.0 * len(equation.sums.counts))
    return float(luck * np.sqrt(square)) if np.isfinite(square) else np.inf


def _both(first: DriveEquation, second: DriveEquation) -> DriveEquation:
    return replace(first, sums=first.sums + second.sums, rms=np.maximum(first.rms, second.rms))


def _combination(known: Mapping[str, float], wanted: Sequence[str]) -> Array:
    """What is regressed (first column) on what (the others) as combinations of the signals, shape (5, 1 + p)."""
    columns = [np.eye(5)[PLACES[name]] for name in wanted]
    load = np.eye(5)[1] + sum((known[n] * np.eye(5)[place] for n, place in PLACES.items() if n in known), np.zeros(5))
    command = np.eye(5)[0]
    return np.column_stack([known[GAIN] * command - load, *columns] if GAIN in known else [command, load, *columns])


def _least_squares(products: Array) -> Array:
    """Coefficients of the regression of the first signal on all others, from products (..., 1 + p, 1 + p)."""
    size = np.sqrt(_positive(np.diagonal(products, axis1=-2, axis2=-1)))
    scaled = products / (size[..., :, None] * size[..., None, :])
    inverse = np.linalg.pinv(scaled[..., 1:, 1:], rcond=1e-12, hermitian=True)
    found = (inverse @ scaled[..., 1:, :1])[..., 0]
    return np.asarray(found * size[..., :1] / size[..., 1:])


def _tells_first(products: Array) -> bool:
    """Whether the first of the signals that are regressed on is more than a combination of the others."""
    size = np.sqrt(_positive(np.diag(products)[1:]))
    scaled = products[1:, 1:] / np.outer(size, size)
    others = np.linalg.lstsq(scaled[1:, 1:], scaled[1:, 0], rcond=1e-12)[0]
    return bool(scaled[0, 0] - scaled[0, 1:] @ others > SEPARATE)


def _positive(values: Array) -> Array:
    return np.maximum(values, 1e-300)
