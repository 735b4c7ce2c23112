# SPDX-License-Identifier: BSD-3-Clause
"""Effects by which a reading lags behind what is measured, by the way it was approached: a play in the sensor.

    lag_k = clip(lag_(k-1) + q_k - q_(k-1), -width, width),   reading = q - lag

The lag is a memory of the state. It follows positions, not velocities: it is exact for steps of any length within
which the motion does not turn round, where a differential equation would be stiff.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from jointscope.robots.effect_kinds.effect import LINK_SIDE, Effect, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import Memory

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

START = 3.0  # [sigma of the encoder] where a calibration begins
CREEP = 1.0  # [sigma of the encoder/sqrt(s)] by which the lag may move of itself; with less, solvers stick at corners
WIDEST = 10.0  # [sigma] by which the lag may be off where a recording begins, where its play is not known to be wider


@dataclass(frozen=True, kw_only=True)
class LaggingReading(Effect):
    """A play between what an encoder is on and what it reads: of the owner joint, or of its encoder on the link.

    Attributes:
        width: name of the parameter that is half of the play [rad].
    """

    width: str

    def may_act_on(self, robot: RobotView, owner: str) -> str:
        """A lag needs steps in which the joint moves by its own equations."""
        if robot.choices.link_dynamics == "free":
            return "needs equations of motion, and the links of this robot are free"
        return super().may_act_on(robot, owner)

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """A calibration begins at a size that the encoder can see."""
        start = START * self.noise_of(robot, owner)
        return tuple(replace(p, start=start) if p.name == self.width else p for p in self.parameters)

    def memory_at(self, robot: RobotView, owner: str) -> Memory:
        """The lag, with the creep that it may have."""
        sigma = self.noise_of(robot, owner)
        half = robot.parameters.get(f"{owner}.{self.id}.{self.width}")
        return Memory(_stands, CREEP * sigma, max(WIDEST * sigma, 0.0 if half is None else half.value))

    @staticmethod
    def noise_of(robot: RobotView, owner: str) -> float:
        """Standard deviation of the encoder that lags [rad]."""
        encoder = robot.link_encoder if owner.endswith(LINK_SIDE) else robot.motor_encoder
        assert encoder is not None
        return float(encoder.sigmas[robot.joints.index(owner.removesuffix(LINK_SIDE))])


def _stands(signals: Any, p: Any) -> float:
    """Of itself the lag stands still: positions move it."""
    return 0.0
