# SPDX-License-Identifier: BSD-3-Clause
"""Messages that have come but are in no tick yet, and how they get into the estimate: in order, or late."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.messages.bookkeeping import Bookkeeping
from jointscope.graphs.fixed_lag.messages.command_history import CommandHistory
from jointscope.graphs.fixed_lag.window.innovation import Innovation
from jointscope.graphs.fixed_lag.window.observation import AT_TICK, Observation
from jointscope.graphs.fixed_lag.window.tick_engine import TickEngine
from jointscope.graphs.problem.timeline import LONGEST_STEP

Array = NDArray[np.float64]

FEW_MISSING = 0.02  # [s] within this every missing command gets its tick; longer gaps go in longer steps
QUICKEST = 5e-4  # [s] shortest step that is made for a missing command


class WaitingMessages:
    """What waits for the next update.

    Args:
        engine: takes it in.
        books: counts it.
        commands: that act.

    Attributes:
        commands: the same.
        samples: of sensors.
        late_command: from when on late commands change what acted [s]; infinity where none are late.
    """

    def __init__(self, engine: TickEngine, books: Bookkeeping, commands: CommandHistory):
        self._engine, self._books, self.commands = engine, books, commands
        self.samples: list[Observation] = []
        self.late_command = math.inf
        self._innovations: list[Innovation] = []  # of late samples since the last update

    @property
    def newest(self) -> float:
        """When the newest sample was taken [s]; minus infinity without one."""
        return max((o.taken for o in self.samples), default=-math.inf)

    def forget(self) -> None:
        """Nothing of what waits is used any more."""
        self.samples.clear()
        self._innovations.clear()
        self.late_command = math.inf

    def parts(self, h: float) -> int:
        """Ticks into which a step of length h [s] is divided: samples are best taken at a tick."""
        usual = min(max(self.commands.period, QUICKEST), LONGEST_STEP)
        return round(h / (usual if h < FEW_MISSING else LONGEST_STEP))

    def acting(self, t0: float, t1: float) -> tuple[Array, Array | None]:
        """Mean command over a step, and the standard deviation of the torques that missing commands leave open."""
        lost = self._books.watch.lost_commands(t1)
        u, doubt = self.commands.acting(t0, t1)
        if lost is not None:
            held, unknown = self.commands.lost(t0, t1)
            u, doubt = np.where(lost, held, u), np.where(lost, unknown, 0.0 if doubt is None else doubt)
        return u, None if doubt is None else doubt * np.abs(self._engine.torque_gain)

    def up_to(self, time: float) -> tuple[list[Innovation], int]:
        """An update: late messages, the step to a new tick, its samples.

        Returns:
            Innovations of all samples since the last update, and how many of the last are not counted yet.
        """
        self.take_late_ones()
        innovations, fresh = list(self._innovations), list[Innovation]()
        self._innovations.clear()
        if time > self._engine.time + AT_TICK:
            now, later = list[Observation](), list[Observation]()
            for o in self.samples:
                (now if o.taken <= time + AT_TICK else later).append(o)
            self.samples = later
            fresh = self._engine.advance(time, *self.acting(self._engine.time, time), now)
        return innovations + fresh, len(fresh)

    def take_late_ones(self) -> None:
        """Takes in messages about times before the newest tick."""
        engine, intake = self._engine, self._books.intake
        if self.late_command < math.inf:
            self._books.reconsidered(engine.correct_commands(self.late_command, self.acting))
            self.late_command = math.inf
        late = [o for o in self.samples if o.taken <= engine.time + AT_TICK]
        if late:
            self.samples = [o for o in self.samples if o.taken > engine.time + AT_TICK]
            for o in late:
                if o.taken < engine.time - AT_TICK:
                    intake.is_late(o, engine.time)
            found = engine.late(late)
            self._books.count(found)
            self._innovations += found
