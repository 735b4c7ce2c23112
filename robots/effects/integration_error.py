# SPDX-License-Identifier: BSD-3-Clause
"""A step of the integrator that is too coarse: no physics."""

from __future__ import annotations

from jointscope.robots.effect_kinds.effect import Card
from jointscope.robots.effect_kinds.structure import Structure

EFFECT = Structure(
    id="integration_error",
    owners=("robot",),
    form="integration",
    card=Card(
        title="step of the integrator too coarse",
        law="x(k+1) = x(k) + step of the chosen rule + defect, where the defect is what a better rule adds",
        explanation="Between two samples the model is integrated by a rule that makes an error of its own: Euler's "
        "shifts the motion by half a step. Choose a better integrator in the robot file (simpson).",
        source="Schuethe et al. (2016), eq. (31), is Euler's rule; Hairer, Norsett, Wanner, Solving Ordinary "
        "Differential Equations I",
        typical="Euler at 1 ms: as a command delay of 0.5 ms",
        excitation="fast oscillation, sharp reversals, long steps",
        look_alikes={
            "command_delay": "Euler's rule shifts the motion by half a step",
            "motor_lag": "Euler's rule shifts the motion by half a step",
        },
        numerics=True,
    ),
)
