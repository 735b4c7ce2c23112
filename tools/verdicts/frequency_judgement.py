# SPDX-License-Identifier: BSD-3-Clause
"""Is this calibration from frequency responses good? Checks with limits, as for recordings of motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.graphs.frequency.explained import Answered, PoseFit
from jointscope.graphs.joint_kinds.calibrate_kinds import KindsCalibration
from jointscope.robots.geometry.arm_effects import FREQUENCY
from jointscope.robots.geometry.error_parameters import STIFFNESS
from jointscope.tools.presentation.frequency_sentences import identifiable_sentence, one_realisation, sticking
from jointscope.tools.presentation.numbers import percent, significant
from jointscope.tools.verdicts.judgement import Check, Judgement
from jointscope.tools.verdicts.pose_judgement import judge_poses, left_out_effects
from jointscope.tools.verdicts.priors.far_from_priors import NAME as AS_EXPECTED_BY_PRIORS
from jointscope.tools.verdicts.priors.far_from_priors import far_parameters
from jointscope.tools.verdicts.same_values import NAME, agreed, test_said

AS_NOISE = 3.0  # power of what is left over that of the noise: up to here friction adds little
ANSWERS_BACK = (
    0.2,
    0.5,
)  # share of what is left that answers the excitation: doubtful from the first, bad from the second
SURE = 5.0  # [sigma] of such a share
WORSE = (1.1, 1.5)  # error of a realisation that the others predict over that of the fit
SHOWN = 3


def judge_frequency(result: FrequencyCalibration) -> Judgement:
    """Applies all checks."""
    checks = tuple(make(result) for make in (_settled, _answer, _noise, _heldout, _agree, _told, _friction))
    level, text = far_parameters(result.robot.parameters, result.told, result.start.path.name)
    unheard = left_out_effects(result.robot, FREQUENCY)
    return Judgement.of((*checks, Check(level, AS_EXPECTED_BY_PRIORS, text), *([] if unheard is None else [unheard])))


def judge_kinds(result: KindsCalibration) -> Judgement:
    """All checks of poses and of frequency responses in one estimate, and whether both tell the same values."""
    found = result.agreement
    if found.doubtful:
        text = (
            f"Poses and frequency responses contradict each other: {test_said(found)}. Stiffness under weight is not "
            "that of the vibration, or one kind is of another arm: calibrate each alone and compare the values."
        )
        agree = Check("bad", NAME, text)
    else:
        agree = Check(*agreed(found, "Poses and frequency responses agree", "poses and frequency responses"))
    return Judgement.of((agree, *judge_poses(result.poses).checks, *judge_frequency(result.frequency).checks))


def _settled(result: FrequencyCalibration) -> Check:
    """Covariances follow values, and values covariances; where no end is reached, springs chase what is not theirs."""
    if result.settled:
        return Check("good", "Values that came to rest", f"Nothing moves any more after {result.stages} stages.")
    return Check(
        "bad",
        "Values that came to rest",
        f"No convergence: values still move after {result.stages} stages; torques, units, joints or start values may "
        "be wrong (look at `jointscope frequency BAG --report frf.html`), or the model lacks an effect.",
    )


def _answer(result: FrequencyCalibration) -> Check:
    """What is left must not answer the excitation."""
    name = "No response is left over"
    found = [(pose, band) for pose in result.explained.poses for band in pose.answered if _sure(band)]
    way = " and ".join(
        text
        for text, there in (
            ("under other phases", any(pose.by_realisations for pose in result.explained.poses)),
            ("at neighbouring lines", not all(pose.by_realisations for pose in result.explained.poses)),
        )
        if there
    )
    if not found:
        return Check("good", name, f"What the torque balance leaves differs {way}: friction and noise.")
    bad = [band for _, band in found if band.share > ANSWERS_BACK[1]]
    worst = sorted(found, key=lambda each: -each[1].share)[:SHOWN]
    said = "; ".join(
        f"{pose.path}, {band.low:g} to {band.high:g} Hz: {percent(band.share)} of the power" for pose, band in worst
    )
    return Check(
        "bad" if bad else "warn",
        name,
        f"What the torque balance leaves recurs {way}, so the model lacks a response ({said}): a joint or bearing "
        "that gives way and is not in the robot file, a delay of the torques, a wrong inertia.",
    )


def _sure(band: Answered) -> bool:
    return band.share > ANSWERS_BACK[0] and band.share > SURE * band.sigma


def _noise(result: FrequencyCalibration) -> Check:
    name = "What is left against the noise"
    known = [pose for pose in result.explained.poses if pose.over_noise is not None]
    left = percent(max(float(pose.left.max()) for pose in result.explained.poses))
    if not known:
        return Check("info", name, f"The balance leaves up to {left} of a motor's torque; one period shows no noise.")
    ratios = [_ratio(pose) for pose in known]
    text = f"The balance leaves up to {left} of a motor's torque, {_range(ratios)} times the power of the noise"
    if max(ratios) > AS_NOISE:
        return Check("info", name, f"{text}: friction beyond its law makes the rest, and sigmas hold it.")
    return Check("good", name, f"{text}.")


def _ratio(pose: PoseFit) -> float:
    assert pose.over_noise is not None
    return float(np.mean(pose.over_noise))


def _range(ratios: Sequence[float]) -> str:
    low, high = significant(min(ratios), 2), significant(max(ratios), 2)
    return low if low == high else f"{low} to {high}"


def _heldout(result: FrequencyCalibration) -> Check:
    name, found = "A realisation that others predict", result.explained
    if not found.heldout:
        return Check("info", name, "One realisation of the phases cannot decide; record another one.")
    ratios = {number: error / found.fitted[number] for number, error in found.heldout.items()}
    worst = max(ratios, key=lambda number: ratios[number])
    level = "good" if ratios[worst] <= WORSE[0] else "warn" if ratios[worst] <= WORSE[1] else "bad"
    text = (
        f"Realisation {worst}, predicted from the others, leaves {significant(found.heldout[worst], 3)} sigmas rms, "
        f"{significant(found.fitted[worst], 3)} in the fit"
    )
    if level != "good":
        text += ": the values follow what friction did under one set of phases; record more of them"
    return Check(level, name, f"{text}.")


def _agree(result: FrequencyCalibration) -> Check:
    name, found = "Recordings that agree on the values", result.explained
    tests = {**found.between_poses, **{f"realisation {n}": a for n, a in found.between_realisations.items()}}
    if not tests:
        return Check("info", name, "One pose and one realisation: nothing to compare; shake the arm in another pose.")
    doubtful = {key: test for key, test in tests.items() if test.doubtful}
    if not doubtful:
        least = min(tests, key=lambda key: tests[key].p_value)
        return Check("good", name, f"All agree; furthest off is {least}, {test_said(tests[least])}.")
    said = "; ".join(f"{key}, {test_said(test)}" for key, test in list(doubtful.items())[:SHOWN])
    return Check(
        "bad",
        name,
        f"In disagreement with the others: {said}. An effect is missing, the load was another, or the arm changed.",
    )


def _told(result: FrequencyCalibration) -> Check:
    springs = [name for name in result.silent if name.split(".", 1)[1] == STIFFNESS]
    level = "warn" if springs else "info" if result.silent else "good"
    return Check(level, "Values that are determined", f"Springs and dampers: {identifiable_sentence(result)}.")


def _friction(result: FrequencyCalibration) -> Check:
    name, sticks, alone = "Friction that is known", sticking(result), one_realisation(result)
    if sticks:
        return Check("warn", name, f"{sticks[0][0].upper()}{sticks[0][1:]}.")
    if alone:
        return Check("info", name, f"{'; '.join(alone)}.")
    return Check("good", name, "Several realisations show what friction does under other phases.")
