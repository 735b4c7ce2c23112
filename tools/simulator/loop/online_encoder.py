# SPDX-License-Identifier: BSD-3-Clause
"""The motor encoders as a controller reads them at the very moment of its tick."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import MotorEncoder
from jointscope.tools.simulator.loop.sensing import read_encoder
from jointscope.tools.simulator.world.engine import TICK, Engine
from jointscope.tools.simulator.world.hooks import age, distort
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]


class OnlineEncoder:
    """Reads at every tick; effects that delay or distort encoders act on what it reads.

    Args:
        encoder: the sensor.
        engine: where the rotors are, and the effects.
        noise: at the ticks, standard normal, shape (ticks, n_joints).
        quantized: whether the encoders have steps.
    """

    def __init__(self, encoder: MotorEncoder, engine: Engine, noise: Array, quantized: bool):
        self._encoder, self._noise, self._quantized = encoder, noise, quantized
        self._motor, self._age = engine.motor, age(engine.effects, encoder)
        self._effects = [effect for effect in engine.effects if effect.uses("reading")]

    def read(self, tick: int, past: Trajectory) -> Array:
        """Motor angles of the robot, the known zero subtracted, shape (n_joints,) [rad]."""
        angles = self._angles(tick * TICK, past)[None]
        if self._effects:
            angles = distort(self._effects, self._encoder, np.array([tick * TICK]), angles)
        return (
            read_encoder(self._encoder, angles, self._noise[tick : tick + 1], self._quantized)[0] - self._encoder.zero
        )

    def _angles(self, now: float, past: Trajectory) -> Array:
        """Motor angles that the encoders are at, old if they are late, shape (n_joints,) [rad]."""
        if not self._age.any():
            return past.q[-1, self._motor]
        return past.at(now - self._age)[0][np.arange(len(self._motor)), self._motor]
