# SPDX-License-Identifier: BSD-3-Clause
"""Random torques on links and rotors, for what a model never contains."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from jointscope.robots.errors import SimulationError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Disturbance:
    """Random torques, drawn per joint and held for one tick.

    Attributes:
        link: standard deviation on each link [N m].
        motor: standard deviation on each rotor, in link units [N m].
        correlation_time: 0 for white noise, else the time constant of a first-order Gauss-Markov process [s].
    """

    link: float = 0.0
    motor: float = 0.0
    correlation_time: float = 0.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not np.isfinite(value) or value < 0:
                raise SimulationError(f"disturbance: {name} must not be negative, got {value:g}")

    @classmethod
    def parse(cls, text: str) -> Disturbance:
        """From "link=0.5,motor=0.3,correlation_time=0.02"; what is not given is zero."""
        known = [field.name for field in fields(cls)]
        values: dict[str, float] = {}
        for item in filter(None, text.split(",")):
            name, _, number = item.partition("=")
            try:
                values[name.strip()] = float(number)
            except ValueError:
                raise SimulationError(f"disturbance: expected name=number, got {item!r}") from None
            if name.strip() not in known:
                raise SimulationError(f"disturbance: unknown {name.strip()!r}; expected {', '.join(known)}")
        return cls(**values)

    def torques(self, rng: np.random.Generator, ticks: int, joints: int, tick: float) -> tuple[Array, Array]:
        """Torques on links and rotors, each of shape (ticks, joints) [N m], for ticks of `tick` seconds."""
        white = rng.standard_normal((2, ticks, joints))
        if self.correlation_time > 0:
            a = np.exp(-tick / self.correlation_time)
            # The first sample gets the stationary variance, so the disturbance has no run-in.
            white[:, 1:] *= np.sqrt(1.0 - a**2)
            white = lfilter([1.0], [1.0, -a], white, axis=1)
        return self.link * white[0], self.motor * white[1]
