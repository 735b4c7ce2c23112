# SPDX-License-Identifier: BSD-3-Clause
"""A reading of an encoder, or of a tracker, that is older than its stamp."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.time_shift import TimeShift

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

Array = NDArray[np.float64]


def late(stamps: Array, p: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """The same for all samples [s]."""
    ones = np.ones_like(stamps)
    return p["delay"] * ones, {"delay": ones}


@dataclass(frozen=True, kw_only=True)
class EncoderDelay(TimeShift):
    """A delay, of a target of either sign: its tracker may have a clock of its own that is ahead."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """Without a sign where a tracker gives the stamps."""
        of_target = any(target.name == owner for target in robot.targets)
        return tuple(replace(p, sign="+-") for p in self.parameters) if of_target else self.parameters


EFFECT = EncoderDelay(
    id="encoder_delay",
    owners=("joint", "link_encoder", "target", "robot"),
    late=late,
    sensors="encoder",
    parameters=(EffectParameter("delay", "s", start=1e-3, prior_sigma=0.5, sign="+"),),
    example={"delay": 3e-3},
    card=Card(
        title="position older than its stamp",
        law="reading(t) = q_motor(t - delay), or q_link(t - delay) for the encoders on the links; of a target "
        "p(t - delay)",
        explanation="Sampling, transport and driver take their time before the reading gets its stamp. For a single "
        "joint: its encoder is read later than those of the others. Cameras expose, compute and send for tens of "
        "milliseconds; where they have a clock of their own, it may be ahead, and the delay is below zero.",
        source="Kelly, Sukhatme (2014), A general framework for temporal calibration of multiple proprioceptive and "
        "exteroceptive sensors, in Experimental Robotics, Springer",
        typical="0.1 to 10 ms; of cameras and motion capture 5 to 100 ms",
        excitation="fast oscillation, with another sensor that sees the same joint",
        look_alikes={
            "encoder_hysteresis": "both trail the motion; play of a sensor by as much at any speed",
            "encoder_filter": "a filter of first order is late, too; the variance is what no delay explains",
            "command_delay": "with the encoder late, motion seems to lag behind the command",
            "motor_lag": "with the encoder late, motion seems to lag behind the command",
            "gyro_delay": "only the difference in time between encoder and gyro shows, but for the command",
            "clock_offset": "only differences in time show",
            "joint_elasticity": "below the resonance the difference between motor and link looks like one in time",
        },
    ),
)
