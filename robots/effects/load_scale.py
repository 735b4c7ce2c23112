# SPDX-License-Identifier: BSD-3-Clause
"""Known loads that are not as large as they were said to be."""

from __future__ import annotations

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.structure import Structure

EFFECT = Structure(
    id="load_scale",
    owners=("robot",),
    form="loads",
    parameters=(EffectParameter("share", "1", start=0.0, prior_sigma=2.0),),
    example={"share": 0.1},
    card=Card(
        title="loads of another size than said",
        law="F = F_load (1 + share), with F_load the force of /load at a rest",
        explanation="The scale was not tared, hook and rope weigh something, kilograms were taken for newtons, or "
        " the rope runs over a pulley with friction: all loads are larger or smaller than said by one share. "
        "Correct the loads; this is no physics of the robot.",
        source="OIML R 111-1 (2004), Weights of classes E1 to M3, on what the nominal mass of a weight is worth",
        typical="1 to 10 % of a load; 90 % where kilograms were taken for newtons",
        excitation="rests with several weights, and some without any; loads say nothing while the robot moves",
        look_alikes={
            "torque_constant_error": "where loads are most of what a drive carries, less torque is as less load",
            "link_mass": "a load at a link is a mass there, if it is always the same",
        },
    ),
)
