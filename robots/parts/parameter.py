# SPDX-License-Identifier: BSD-3-Clause
"""One number that a calibration may change, with its unit, its prior and what is known about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from jointscope.robots.parts.shown_value import ShownValue


@dataclass(frozen=True, repr=False)
class Parameter(ShownValue):
    """A scalar parameter OWNER.NAME of a robot.

    Positive parameters are estimated as logarithms, so they cannot change sign; their prior sigma is then
    relative to the prior mean.

    Attributes:
        name: full name, for example "joint1.stiffness".
        value: present value, in `unit`.
        unit: SI unit as text.
        prior: mean of the prior, in `unit`; the start value of the first calibration.
        prior_sigma: standard deviation of the prior, in `unit`.
        positive: True if the parameter must stay above zero.
        fixed: True if calibration must leave it alone.
        sigma: standard deviation after calibration, in `unit`; None before.
        published: value from the literature for comparison; None where there is none.
        effect: id of the effect the parameter belongs to; None for the base model.
        null: value at which the effect vanishes; None for the base model and for shapes.
    """

    name: str
    value: float
    unit: str
    prior: float
    prior_sigma: float
    positive: bool = True
    fixed: bool = False
    sigma: float | None = None
    published: float | None = None
    effect: str | None = None
    null: float | None = None

    @property
    def owner(self) -> str:
        """What the parameter belongs to: "motor", "joint1", "imu2"."""
        return self.name.split(".", 1)[0]

    @property
    def remark(self) -> str:
        """Whether calibration leaves it alone."""
        return "fixed" if self.fixed else ""

    @property
    def coordinate_sigma(self) -> float:
        """Prior sigma of what is estimated: relative where that is the logarithm."""
        return self.prior_sigma / self.prior if self.positive else self.prior_sigma


def with_sigmas(parameters: Mapping[str, Parameter], sigmas: Mapping[str, float]) -> dict[str, Parameter]:
    """The same parameters, some with the standard deviation that was found, by name."""
    return {name: replace(p, sigma=sigmas[name]) if name in sigmas else p for name, p in parameters.items()}
