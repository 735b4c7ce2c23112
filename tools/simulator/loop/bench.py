# SPDX-License-Identifier: BSD-3-Clause
"""Who brings a robot to rest in one posture after the other, and hangs weights on it while it stands.

To each posture every joint comes from its own side. The controller

    torque = weight + stiff (target - q) + damp (v_target - v) + friction of the way

knows the weight of the links and not what hangs on them, and has no integral: a motor stops where friction holds it,
at the edge of its band. Before some rests it gives way a little, so that friction then stands anywhere in its band.
A hand hangs a weight slowly, and waits until nothing swings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.simulator.loop.online_encoder import OnlineEncoder
from jointscope.tools.simulator.loop.postures import CALMLY, Holding, Posture, ways
from jointscope.tools.simulator.world.engine import TICK
from jointscope.tools.simulator.world.sticking_engine import StickingEngine
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]
EVERY = 5  # ticks from one command to the next
PERIOD = EVERY * TICK  # [s]
SERVO, FASTEST = 2.0 * np.pi * 3.0, 2.0 * np.pi * 5.0  # [rad/s] of the position controller, and what it may be
STOPS = 0.005  # of a joint's range within which the motor stops: the controller is stiff enough for that
AHEAD = 0.9  # of the dry friction that the controller knows, in the direction in which a motor has moved last
TURNS = 0.2  # of a move, in which the controller takes the new direction for it
DIFFERENCE = 20  # ticks between the angles of which a speed is made
BEGIN = 0.2  # [s] before the first move, too short for a rest
HAND, STEP = 1.0, 4  # [s] that a hand takes to hang a weight at least, and commands from one step of it to the next
GIVES_WAY, AGAIN = 0.4, 0.5  # [s] that this takes, and share of the rests that it is done before
INSIDE = 0.95  # of the friction band, into which it is done
CALM, LOOKED_AT = 4.0, 0.4  # [sigma] by which encoders may still move, and for how long they are looked at [s]
PATIENCE = 6.0  # [s]


def longest(holding: Holding, postures: Sequence[Posture], masses: Sequence[float], hold: float) -> float:
    """How long it can take at most to bring a robot to rest in all postures with all masses [s]."""
    moves = sum(holding.duration(a, b) + PERIOD for a, b in ways(postures))
    return (
        BEGIN + moves + len(postures) * (GIVES_WAY + len(masses) * (PATIENCE + LOOKED_AT + _hand(holding) + hold)) + 1.0
    )


def _hand(holding: Holding) -> float:
    return max(HAND, CALMLY * holding.period)


def _smooth(s: float) -> float:
    """Of minimum jerk, from 0 to 1."""
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


@dataclass(frozen=True)
class RestTruth:
    """A rest as it really was.

    Attributes:
        begin, end: in which nothing was done [s].
        mass: that hung on the link [kg].
        force: of it, in the axes of the world, shape (3,) [N].
        held, most: torque with which friction held each motor at the end, and the most that it could, shape (n,) [N m].
    """

    begin: float
    end: float
    mass: float
    force: Array
    held: Array
    most: Array


class Bench:
    """Reads the encoders, and remembers what was commanded and what hung there.

    Args:
        engine: that moves the robot.
        encoder: what the controller measures with.
        holding: of the robot.
        postures: in their order.
        masses: that hang on the link in each posture, in turn; in every second one from the last to the first [kg].
        gravity: shape (3,) [m/s^2].
        hold: how long each rest is left alone [s].
        rng: draws how far the controller gives way.

    Attributes:
        force: that hangs on the link now, shape (3,) [N].
        finished: whether all rests are over.
        commands: one for each `PERIOD`, shape (k, n), in the unit of the robot's command.
        loads: when another force began, and that force [s], [N].
        rests: as they really were.
        start: where links are when it begins, shape (n,) [rad].
    """

    def __init__(
        self,
        engine: StickingEngine,
        encoder: OnlineEncoder,
        holding: Holding,
        postures: Sequence[Posture],
        masses: Sequence[float],
        gravity: Array,
        hold: float,
        rng: np.random.Generator,
    ):
        self.force, self.finished = np.zeros(3), False
        self.commands: list[Array] = []
        self.loads: list[tuple[float, Array]] = []
        self.rests: list[RestTruth] = []
        self.start = postures[0].before
        self._engine, self._encoder, self._holding = engine, encoder, holding
        self._postures, self._masses, self._gravity = postures, masses, gravity
        self._hold, self._rng = hold, rng
        robot = holding.robot
        reach = np.abs(np.linalg.inv(holding.T)) @ holding.half
        wanted = np.maximum(holding.inertia * SERVO**2, holding.dry / (STOPS * reach))
        self._stiff = np.minimum(wanted, holding.inertia * FASTEST**2)
        own = np.array(
            [robot.drive_parameter(j, "k_mi").value if "k_mi" in robot.drive_laws else 0.0 for j in robot.joints]
        )
        self._own_damping = own
        self._damp = np.maximum(2.0 * np.sqrt(self._stiff * holding.inertia) - own, 0.0)
        links = robot.link_encoder
        self._still = CALM * np.concatenate([robot.motor_encoder.sigmas, () if links is None else links.sigmas])
        self._seen = engine.motor if links is None else np.concatenate([engine.motor, engine.link])
        self._target, self._rate = holding.motors(self.start), np.zeros(robot.n)
        self._weight, self._shift = holding.torques(self.start), np.zeros(robot.n)
        self._way = np.zeros(robot.n)
        self._readings: list[Array] = []
        self._now, self._past = 0.0, Trajectory(TICK, np.zeros((1, 1)), np.zeros((1, 1)))
        self._command = np.zeros(robot.n)
        self._mass = masses[0]
        self._hang(masses[0])
        self._course = self._all()

    def __call__(self, tick: int, past: Trajectory) -> Array:
        """The command of a tick, shape (n,), for what has happened until now."""
        if tick % EVERY:
            return self._command
        self._now, self._past = tick * TICK, past
        if next(self._course, None) is None:
            self.finished = True
            return self._command
        q = self._encoder.read(tick, past)
        self._readings.append(q)
        before = self._readings[max(0, len(self._readings) - 1 - DIFFERENCE // EVERY)]
        v = (q - before) / (PERIOD * min(max(len(self._readings) - 1, 1), DIFFERENCE // EVERY))
        holding = self._holding
        torque = self._weight + self._shift + self._stiff * (self._target - q) + self._damp * (self._rate - v)
        torque += self._own_damping * self._rate + AHEAD * holding.dry * self._way
        self._command = np.clip(torque, -holding.most, holding.most) / holding.gains
        self.commands.append(self._command)
        return self._command

    def _all(self) -> Iterator[bool]:
        """What is done, one item for each command."""
        yield from self._wait(BEGIN)
        last = self.start
        for k, posture in enumerate(self._postures):
            yield from self._move(last, posture.before)
            yield from self._move(posture.before, posture.q)
            for i, mass in enumerate(self._masses[:: 1 if k % 2 == 0 else -1]):
                if i:
                    yield from self._change(mass)
                yield from self._calm()
                if i == 0:
                    yield from self._give_way()
                begin = self._now
                yield from self._wait(self._hold)
                self.rests.append(RestTruth(begin, self._now, mass, self.force.copy(), *self._engine.friction()))
            last = posture.q

    def _wait(self, seconds: float) -> Iterator[bool]:
        for _ in range(round(seconds / PERIOD)):
            yield True

    def _move(self, a: Array, b: Array) -> Iterator[bool]:
        """A minimum-jerk move of all links together."""
        seconds, begin, began = self._holding.duration(a, b), self._shift.copy(), self._target
        turned, there = self._way.copy(), np.sign(self._holding.motors(b) - self._holding.motors(a))
        steps = max(round(seconds / PERIOD), 1) if seconds else 0
        for k in range(1, steps + 1):
            s = k / steps
            q = a + (b - a) * _smooth(s)
            target = self._holding.motors(q)
            self._rate = (target - began) / PERIOD
            self._target, began = target, target
            self._weight, self._shift = self._holding.torques(q), begin * (1.0 - s)
            self._way = turned + (there - turned) * _smooth(min(s / TURNS, 1.0))
            yield True
        self._rate = np.zeros_like(a)

    def _change(self, mass: float) -> Iterator[bool]:
        """A hand takes one weight off while it hangs another."""
        before, steps = self._mass, round(_hand(self._holding) / PERIOD)
        for k in range(1, steps + 1):
            if k % STEP == 0:
                self._hang(before + (mass - before) * _smooth(k / steps))
            yield True
        self._mass = mass

    def _hang(self, mass: float) -> None:
        self.force = mass * self._gravity
        self.loads.append((self._now, self.force))

    def _calm(self) -> Iterator[bool]:
        """Waits until encoders no longer tell any motion."""
        window, waited = round(LOOKED_AT / TICK), 0.0
        while waited < PATIENCE:
            yield from self._wait(0.5 * LOOKED_AT)
            waited += 0.5 * LOOKED_AT
            moved = np.ptp(self._past.q[-window:, self._seen], axis=0)
            if len(self._past.q) > window and np.all(moved < self._still):
                break

    def _give_way(self) -> Iterator[bool]:
        """Some motors are let go a little, and friction holds them instead, anywhere within its band."""
        held, most = self._engine.friction()
        wanted = INSIDE * most * self._rng.uniform(-1.0, 1.0, len(most))
        lets = (self._rng.random(len(most)) < AGAIN) & self._engine.sticks()
        begin, end = self._shift.copy(), self._shift + np.where(lets, held - wanted, 0.0)
        steps = round(GIVES_WAY / PERIOD)
        for k in range(1, steps + 1):
            self._shift = begin + (end - begin) * _smooth(k / steps)
            yield True
