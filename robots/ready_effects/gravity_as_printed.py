# SPDX-License-Identifier: BSD-3-Clause
"""Gravity of the BioRob as eq. (11) of its paper is printed, beside that of the URDF; of `biorob_paper` alone.

As printed its first row has the last three terms with the other sign. No potential has such a gradient (dg_1/dq_2 and
dg_2/dq_1 differ by up to 3.3 N m/rad), so that no masses of a URDF can make it: what is too much stands here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.robot_torque import RobotSignals, RobotTorque

BETA = (0.80249, 0.7541, 0.1393)  # [N m] beta_3 to beta_5 of Table 2
DIAGONAL = (0.0079 / 0.0245, 0.0121 / 0.0403, 0.0121 / 0.0306, 0.0090 / 0.0250)  # of J_t, radii of Table 1
AS_PRINTED = -(0.0121 / 0.0250) * (0.0090 / 0.0250)  # J_t(4,3): the idler's radius is not in it


def law(s: RobotSignals, p: Mapping[str, Any]) -> tuple[Any, Any]:
    """-share 2 s1 (s2 beta_3 + s23 beta_4 + s234 beta_5) on joint 1 [N m], by angles of the pulleys."""
    pulleys = s.q_link
    q1, q2, q3 = (DIAGONAL[i] * pulleys[:, i] for i in range(3))
    q4 = DIAGONAL[3] * pulleys[:, 3] + AS_PRINTED * pulleys[:, 2]
    sums = (np.sin(q2), np.sin(q2 + q3), np.sin(q2 + q3 + q4))
    turned = 2.0 * np.sin(q1) * sum(beta * each for beta, each in zip(BETA, sums, strict=True))
    on_links = np.zeros_like(pulleys)
    on_links[:, 0] = -p["share"] * DIAGONAL[0] * turned
    return on_links, np.zeros_like(pulleys)


EFFECT = RobotTorque(
    id="gravity_as_printed",
    owners=("robot",),
    law=law,
    parameters=(EffectParameter("share", "1", start=1.0, prior_sigma=1.0),),
    example={"share": 1.0},
    card=Card(
        title="gravity of the BioRob as printed",
        law="M a + ... = -share 2 sin(q1) (sin(q2) beta_3 + sin(q2 + q3) beta_4 + sin(q2 + q3 + q4) beta_5) on joint 1",
        explanation="The sign of three terms in the printed vector. None of the paper's five postures shows it.",
        source="Ho, Kisner (BioRob), eq. (11) and Table 2",
        typical="1 as printed, 0 as physics has it",
        excitation="rests or motion with joint 1 away from zero and joints 2 to 4 away from level",
    ),
)
