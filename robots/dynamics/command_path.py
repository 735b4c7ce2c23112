# SPDX-License-Identifier: BSD-3-Clause
"""From the logged commands to those that act: delays, lags and dead bands need the whole history of a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.command_effect import CommandEffect, CommandLaw
from jointscope.robots.effect_kinds.effect_at import EffectAt

Array = NDArray[np.float64]

PARTS = 4  # of a step in which a measured signal is moved in time: half a step of a staircase costs (2 pi f h)^2 / 8


class CommandPath:
    """Commands of one recording and the effects that change them, one after the other.

    Args:
        edges: edges of the steps, shape (m + 1,) [s].
        u: logged commands, shape (m, n), SI unit of the command.
        effects: effects of the robot; others than those of commands are ignored.
        joints: names of the joints.
        runs_on: whether the signal was measured, and changes within the steps, too; a command is constant over each.
    """

    def __init__(
        self, edges: Array, u: Array, effects: Sequence[EffectAt], joints: tuple[str, ...], runs_on: bool = False
    ):
        self._edges, self._u, self._joints = edges, u, joints
        self.runs_on = runs_on and len(u) > 1
        self._effects = [here for here in effects if isinstance(here.effect, CommandEffect)]
        self._cache: tuple[tuple[float, ...], tuple[Array, dict[str, Array]]] | None = None

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self._joints)

    @property
    def changes(self) -> bool:
        """Whether any effect changes the commands."""
        return bool(self._effects)

    def acting(self, values: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
        """Mean command that acts in each step, and its derivatives by the effects' parameters.

        Args:
            values: parameters of the robot by full name.

        Returns:
            Shape (m, n), and the same shape for each full name.
        """
        own = [[(p.name, values[here.parameter(p.name)]) for p in here.effect.parameters] for here in self._effects]
        key = tuple(value for part in own for _, value in part)
        known = self._cache  # another thread may put other commands there
        if known is None or known[0] != key:
            known = self._cache = (key, self._evaluate([dict(part) for part in own]))
        return known[1]

    def rises(self, of_steps: Array) -> Array:
        """By how much a signal rises from the beginning to the end of each step, from its means there, shape (m, n)."""
        middle = 0.5 * (self._edges[:-1] + self._edges[1:])
        return np.asarray(np.gradient(of_steps, middle, axis=0) * np.diff(self._edges)[:, None])

    def _evaluate(self, own: list[dict[str, float]]) -> tuple[Array, dict[str, Array]]:
        if not (self.runs_on and self._effects):
            return self._through_effects(self._edges, self._u, own)
        place = (np.arange(PARTS) + 0.5) / PARTS - 0.5
        finer = self._u[:, None] + place[:, None] * self.rises(self._u)[:, None]
        inner = self._edges[:-1, None] + np.arange(PARTS) / PARTS * np.diff(self._edges)[:, None]
        edges, shape = np.append(inner, self._edges[-1]), finer.shape
        u, slopes = self._through_effects(edges, finer.reshape(-1, shape[2]), own)
        return u.reshape(shape).mean(axis=1), {n: s.reshape(shape).mean(axis=1) for n, s in slopes.items()}

    def _through_effects(self, edges: Array, u: Array, own: list[dict[str, float]]) -> tuple[Array, dict[str, Array]]:
        """What the effects make of means over steps, one after the other."""
        u, slopes = u.copy(), dict[str, Array]()
        for here, p in zip(self._effects, own, strict=True):
            before = u.copy()
            joints = range(len(self._joints)) if here.owner == "robot" else (self._joints.index(here.owner),)
            for j in joints:
                u[:, j], by = law_of(here)(edges, before[:, j], p)
                for name, slope in by.items():
                    slopes.setdefault(here.parameter(name), np.zeros_like(u))[:, j] = slope
        return u, slopes


def law_of(here: EffectAt) -> CommandLaw:
    """The law of a command effect."""
    assert isinstance(here.effect, CommandEffect)
    return here.effect.law
