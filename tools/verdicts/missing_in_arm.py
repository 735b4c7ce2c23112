# SPDX-License-Identifier: BSD-3-Clause
"""What a calibrated arm lacks, by poses or where a response is left over, named in the verdict of `calibrate`."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from jointscope.graphs.joint_kinds.arm_candidates import Calibrated
from jointscope.graphs.joint_kinds.discover_arm import candidates_of
from jointscope.graphs.joint_kinds.effect_judge import ArmCandidate
from jointscope.graphs.joint_kinds.spring_screen import badly_explained
from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.robots.geometry.error_parameters import BEARING, STIFFNESS
from jointscope.tools.presentation.numbers import significant

FREE = 10.0  # [1] sigma of the logarithm of a stiffness


@lru_cache(maxsize=4)
def missing_by_poses(result: PoseCalibration) -> tuple[ArmCandidate, ...]:
    """Effects of which poses say that they are missing, best first; of one calibration they are asked once."""
    found = [c.beside_the_best for c in candidates_of(Calibrated(_with_free_springs(result), None))[0]]
    return tuple(c for c in found if c.verdict == "missing")


def _with_free_springs(result: PoseCalibration) -> PoseCalibration:
    """The same, with priors that let springs be rigid: those of the logarithm keep them from it.

    What is left of sag in an arm that has none would be taken for an effect.
    """
    springs = {
        name: replace(p, prior=p.value, prior_sigma=FREE * p.value)
        for name, p in result.robot.parameters.items()
        if p.positive and name.endswith((f".{STIFFNESS}", *BEARING))
    }
    return replace(result, robot=replace(result.robot, parameters={**result.robot.parameters, **springs}))


def missing_in_arm(result: Calibrated) -> tuple[ArmCandidate, ...]:
    """Effects that are missing, best first; none is asked where what is left answers nothing."""
    frequency = result.frequency
    if frequency is None or (frequency.settled and not badly_explained(frequency.explained)):
        return ()
    found = [c.beside_the_best for c in candidates_of(result)[0]]
    return tuple(c for c in found if c.verdict == "missing")


def missing_sentence(missing: tuple[ArmCandidate, ...]) -> str:
    """What to say of them."""
    first, *others = missing
    sizes = ", ".join(significant(size, 3) for size in first.sizes)
    unit = "rad/(N m)" if first.hypothesis.kind.soft else first.hypothesis.kind.unit
    also = f"; then {', '.join(c.hypothesis.label for c in others[:2])}" if others else ""
    return (
        f"  ! The model lacks {first.hypothesis.label}, about {sizes} {unit}{also}: `jointscope discover` with the "
        "same recordings adds it and calibrates again"
    )
