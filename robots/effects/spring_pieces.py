# SPDX-License-Identifier: BSD-3-Clause
"""Springs whose torque grows over the deflection by a slope that is given at knots, each side with its own.

Between knots the slope goes straight from one to the next, beyond the last it stays. A knot has a number h: its slope
is (1 + h) times the stiffness where h is above zero, e^h times below, so that the torque grows with the deflection
whatever the values are, and no trial of a calibration is beyond all bounds. The family has members with one, two
and four knots a side; which of them a recording deserves is a question of evidence, not of choice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque

MEMBERS = (1, 2, 4)  # knots a side
REACH = 0.05  # [rad] where nothing was seen
LARGEST = 10.0  # by which a slope may be more than the stiffness, as a share of it, 1 sigma


def law(pieces: int, s: JointSignals, p: Mapping[str, Any]) -> Any:
    """Torque beyond K d [N m]: K times the integral of (slope / K - 1) over the deflection, exactly zero at null.

    Args:
        pieces: knots a side.
        s: motion of the joint.
        p: slopes at the knots, the turn at zero, and how far the last knots are.
    """
    d = s.deflection
    ahead, behind = np.where(np.real(d) > 0.0, d, 0.0), np.where(np.real(d) > 0.0, 0.0, -d)
    forward = [0.0, *(_more(p[f"forward_{k}"]) for k in range(1, pieces + 1))]
    backward = [_more(p["turn"]), *(_more(p[f"backward_{k}"]) for k in range(1, pieces + 1))]
    return s.stiffness * (_integral(ahead, p["forward"], forward) - _integral(behind, p["backward"], backward))


def _more(h: Any) -> Any:
    """By which a slope is more than the stiffness, as a share of it: h above zero, e^h - 1 below; never below -1."""
    return h if np.real(h) > 0.0 else np.expm1(h)


def _integral(x: Any, reach: Any, slopes: list[Any]) -> Any:
    """Integral from 0 to x of the slope that goes straight from knot to knot, x >= 0.

    Args:
        x: shape (m,).
        reach: place of the last knot; the others divide the way to it evenly, the first is at 0.
        slopes: at the knots.
    """
    width = reach / (len(slopes) - 1)
    bends = np.diff([0.0, *np.diff(np.asarray(slopes)), 0.0]) / width
    total = slopes[0] * x
    for k, bend in enumerate(bends):
        beyond = x - k * width
        total = total + 0.5 * bend * np.where(np.real(beyond) > 0.0, beyond, 0.0) ** 2
    return total


@dataclass(frozen=True, kw_only=True)
class SpringPieces(JointTorque):
    """A member of the family.

    Attributes:
        pieces: knots a side.
    """

    pieces: int

    def refined(self, coarse: SpringPieces, p: Mapping[str, float]) -> dict[str, float]:
        """Values at which this law is that of a coarser member whose knots are among its own.

        Args:
            coarse: the other member.
            p: its values, by the last part of their names.
        """
        found = {name: p[name] for name in ("turn", "forward", "backward")}
        at, own = np.linspace(0.0, 1.0, coarse.pieces + 1), np.linspace(0.0, 1.0, self.pieces + 1)[1:]
        for side, first in (("forward", 0.0), ("backward", p["turn"])):
            slopes = [_more(first), *(_more(p[f"{side}_{k}"]) for k in range(1, coarse.pieces + 1))]
            for k, more in enumerate(np.interp(own, at, slopes), 1):
                found[f"{side}_{k}"] = float(more if more > 0.0 else np.log1p(more))
        return found


def _slope(name: str) -> EffectParameter:
    return EffectParameter(name, "1", start=0.0, prior_sigma=LARGEST)


def _reach(side: str) -> EffectParameter:
    return EffectParameter(
        side, "rad", start=REACH, prior_sigma=REACH, sign="+", logarithmic=True, grid=(1.0,), held=True, of_range=side
    )


def _member(pieces: int) -> SpringPieces:
    """The effect with so many knots a side."""
    knots = [f"{side}_{k}" for side in ("forward", "backward") for k in range(1, pieces + 1)]
    others = {f"spring_pieces_{other}": "the same curve with knots elsewhere" for other in MEMBERS if other != pieces}
    return SpringPieces(
        pieces=pieces,
        id=f"spring_pieces_{pieces}",
        family="spring_pieces",
        side="spring",
        curve="whole",
        law=partial(law, pieces),
        parameters=(*map(_slope, ("turn", *knots)), _reach("forward"), _reach("backward")),
        example={"turn": 0.2, "forward": 0.03, "backward": 0.04}
        | {name: 0.5 + 0.3 * k for k, name in enumerate(knots)},
        card=Card(
            title=f"spring that always grows, knots a side: {pieces}",
            law="tau_c = integral of the slope over d + D (v_link - v_motor), d = q_link - q_motor; slope = K (1 + h), "
            "or K e^h for h < 0, straight between knots: h = 0 just above d = 0, turn just below, forward_k at k/n of "
            f"forward, backward_k at k/n of -backward, the same beyond; n = {pieces}",
            explanation="A rope drive pulls over another spring either way, each with its own range, and gets stiffer "
            "where rope, spring and string take over from each other. No values make such a curve fall, as a "
            "polynomial does beyond the loads that were measured.",
            source="Ho, Kisner (BioRob), eq. (28) and fig. 4: force-elongation curves; Ramsay (1998), Estimating "
            "smooth monotone functions, J. Royal Statistical Society B 60(2): slopes that cannot be negative",
            typical="slopes a third to ten times the stiffness; forward and backward as far as it was deflected",
            excitation="large deflections both ways: weights that pull up and down, hard stops, fast reversals",
            look_alikes={
                "spring_cubic": "hardens as well, alike in both directions",
                "spring_curve": "bends as well; the same where a polynomial of third degree is all there is",
                "spring_slack": "a side that is soft near zero looks like slack of its rope",
                "spring_limit": "a steep last piece is what a string does beyond its length",
                **others,
            },
        ),
    )


EFFECTS = tuple(map(_member, MEMBERS))
