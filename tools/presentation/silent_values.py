# SPDX-License-Identifier: BSD-3-Clause
"""Values of which poses give no sigma: those they say nothing about, and springs too stiff to be seen giving way."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.robots.geometry.error_parameters import BEARING, STIFFNESS
from jointscope.robots.parts.parameter import Parameter
from jointscope.tools.presentation.numbers import significant

SIGMAS = 2.0  # of the bound that is said


def silent_sentences(result: PoseCalibration) -> list[str]:
    """One for what is not told, one for what is only known to be stiff."""
    silent = [name for name in result.names if name not in result.told]
    bounds = {name: bound for name in silent if (bound := _at_least(result.robot.parameters[name]))}
    others = [name for name in silent if name not in bounds]
    said = [f"The poses say nothing about {', '.join(others)}."] if others else []
    if bounds:
        stiff = ", ".join(f"{name} above {significant(bound, 2)} N m/rad" for name, bound in bounds.items())
        said.append(f"Too stiff for these poses to see them give way, so only bounds are known (two sigmas): {stiff}.")
    return said


def _at_least(p: Parameter) -> float | None:
    """Stiffness that a spring has at the least; None where poses do not say that it is above its prior.

    What poses know of the logarithm of a stiffness they know, as a share, of its compliance, which may be zero.
    """
    if not p.name.endswith((f".{STIFFNESS}", *BEARING)) or not p.positive or not p.sigma:
        return None
    told = (p.value / p.sigma) ** 2 - p.coordinate_sigma**-2.0
    if told <= 0.0:
        return None
    bound = p.value / (1.0 + SIGMAS / float(np.sqrt(told)))
    return bound if bound > p.prior else None
