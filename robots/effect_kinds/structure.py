# SPDX-License-Identifier: BSD-3-Clause
"""Effects that change what the model is made of: more coordinates, or terms of the rigid bodies themselves."""

from __future__ import annotations

from dataclasses import dataclass

from jointscope.robots.effect_kinds.effect import Effect

FORMS = ("bearing", "elasticity", "coriolis", "integration", "gravity", "axis", "loads")


@dataclass(frozen=True, kw_only=True)
class Structure(Effect):
    """A structural effect; the model knows the form.

    Attributes:
        form: "bearing" (two sprung hinges before the owner), "elasticity" (a spring between motor and link of a joint
            declared rigid), "coriolis" (scaled c(q, v)), "integration" (the defect of the integrator), "gravity"
            (turned), "axis" (of the owner, turned), "loads" (known ones at rest, scaled).
    """

    form: str
