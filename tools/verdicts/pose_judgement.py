# SPDX-License-Identifier: BSD-3-Clause
"""Is this calibration from poses good? Checks with limits, as for recordings of motion."""

from __future__ import annotations

from collections import Counter
from functools import lru_cache

import numpy as np

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.graphs.poses.determined import sigma_elsewhere
from jointscope.graphs.poses.linear_poses import LinearPoses
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.screen_contacts import moved_contacts
from jointscope.graphs.poses.tip_errors import summary
from jointscope.graphs.poses.trimmed_poses import Outlier
from jointscope.graphs.poses.untold_distances import untold_distance
from jointscope.graphs.poses.what_moved import Step, what_moved, with_ends
from jointscope.robots.geometry.arm_effects import POSES
from jointscope.robots.geometry.error_parameters import BACKLASH
from jointscope.robots.geometry.unheard_effects import unheard_effects
from jointscope.robots.model.robot import Robot
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.verdicts.judgement import Check, Judgement
from jointscope.tools.verdicts.missing_in_arm import missing_by_poses
from jointscope.tools.verdicts.priors.far_from_priors import FAR, far_parameters
from jointscope.tools.verdicts.priors.far_from_priors import NAME as AS_EXPECTED_BY_PRIORS

REDUNDANT = (2.0, 1.2)  # measured coordinates per independent value: fine from the first, bad below the second
REPEATS = (3.0, 10.0)  # times the repeatability of the robot file that poses may ask for
UNSEEN = 0.05  # of the target's noise: what transmissions make of it at the end of an arm of a METRE is not seen
METRE = 1.0  # [m]
SURE = 3.0  # [sigma]
SHOWN = 4
GIVEN_UP = 0.5  # share of the poses on one side of a step that are left out where they are that side
OUT = 0.1  # share of the poses that may be left out
ELSEWHERE = (10.0, 100.0)  # times what is left at the poses that the target may be uncertain in other postures
BEYOND = 3.0  # [sigma of the prior] that no geometric error should reach; beyond FAR the calibration is worth nothing
APART = (3.0, 10.0)  # [sigma] that a distance which is said may be from that of the arm: doubtful, and wrong


def judge_poses(result: PoseCalibration) -> Judgement:
    """Applies all checks."""
    makers = (_enough, _elsewhere, _repeatability, _turns, _outliers, _still, _within, _near_priors, _apart, _lacks)
    checks = (*(make(result) for make in (*makers, _backlash, _worth)), left_out_effects(result.robot, POSES))
    return Judgement.of([check for check in checks if check is not None])


def left_out_effects(robot: Robot, kind: str) -> Check | None:
    """Effects of the robot file that act on recordings of a kind and have no part in their model; None without any."""
    labels, name = unheard_effects(robot, kind), "Effects of the robot file that take part"
    if not labels:
        return None
    what, where = ("poses", "at rest") if kind == POSES else ("frequency responses", "in a vibration")
    return Check(
        "warn",
        name,
        f"{', '.join(labels)} of {robot.path.name} {'acts' if len(labels) == 1 else 'act'} {where}, too, and {what} "
        "leave it out: geometry and stiffnesses take up what it does. Motion and rests have all of the catalogue.",
    )


def _enough(result: PoseCalibration) -> Check:
    measured = sum(problem.measured for problem in result.problems)
    contacts = sum(problem.own_coordinates for problem in result.problems)
    values = result.determined.rank + sum(n not in _geometric(result) for n in result.told)
    ratio = (measured - contacts) / max(values, 1)
    level = "good" if ratio >= REDUNDANT[0] else "warn" if ratio >= REDUNDANT[1] else "bad"
    text = f"{measured - contacts} measured coordinates tell {values} values"
    if level != "good":
        more = int(np.ceil((REDUNDANT[0] * values - measured + contacts) / 3))
        text += f"; {more} more poses would make the values trustworthy; until then priors decide part of them"
        weak = sorted(result.told, key=lambda n: -_kept(result, n))[:SHOWN]
        text += f", most of all {', '.join(weak)}"
    return Check(level, "Enough poses", f"{text}.")


def _kept(result: PoseCalibration, name: str) -> float:
    """Share of a prior's sigma that the poses have left."""
    p = result.robot.parameters[name]
    return (p.sigma or 0.0) / p.prior_sigma


def _elsewhere(result: PoseCalibration) -> Check:
    """Whether priors decide where the target is in postures that are unlike the poses."""
    sigma, left = sigma_elsewhere(result), float(np.median(summary(result.errors).distances))
    ratio = sigma / max(left, 1e-12)
    level = "good" if ratio <= ELSEWHERE[0] else "warn" if ratio <= ELSEWHERE[1] else "bad"
    text = (
        f"Within the joints' limits the target is known to {significant(1e3 * sigma, 2)} mm (sigma, 90 % of postures)"
    )
    if level != "good":
        scaled = all(p.poses.target is not None or p.distances(c)[0].size for p, c in _solved(result))
        wanted = "record poses all over the workspace"
        if not scaled:
            wanted = "nothing sets the scale of the arm: give contacts places, and the robot file `contact_distance`"
        text += f", {significant(ratio, 2)} times what is left at these poses: priors decide the rest; " + wanted
    return Check(level, "Poses all over the workspace", f"{text}.")


def _solved(result: PoseCalibration) -> list[tuple[PoseSet, Calibration]]:
    return list(zip(result.problems, result.calibrations, strict=True))


def _outliers(result: PoseCalibration) -> Check:
    name, targets = "Poses that fit", Counter(each.target for each in result.left_out)
    whole, odd = targets[""], {target: count for target, count in targets.items() if target}
    total, seen = result.count + whole, Counter(summary(result.errors).names)
    text = f"{total - whole} of {total} poses fit"
    text += "".join(f", {target} not in {count} of {seen[target] + count}" for target, count in odd.items())
    shares = [whole / total, *((whole + n) / (seen[target] + whole + n) for target, n in odd.items())]
    if max(shares) <= OUT:
        return Check("good", name, f"{text}{_elsewhere_held(result)}.")
    hint = "look at each before you leave them out for good: targets or readings are wrong, or an effect is missing"
    if result.left_out and not outliers_of(result):
        hint = "all of them are on one side of what moved, which is named, and are no outliers"
    out = "".join(f", {target} of {count} of {seen[target] + count}" for target, count in odd.items())
    together = _elsewhere_held(result)
    return Check("warn", name, f"{whole} of {total} poses{out} were left out{together}; {hint}.")


def _elsewhere_held(result: PoseCalibration) -> str:
    """Poses that were left out because their contact was elsewhere."""
    moved = moved_contacts(result.problems, result.whole, result.calibrations)
    if not moved:
        return ""
    each = (f"{m.first} to {m.last} by {significant(1e3 * m.size, 2)} mm ({m.contact})" for m in moved[:SHOWN])
    more = f" and {len(moved) - SHOWN} more" if len(moved) > SHOWN else ""
    return (
        f"; some are off together in one direction: {', '.join(each)}{more}: the plate was moved or gave way; hold it "
        "fast, or give these poses a contact of their own"
    )


def _still(result: PoseCalibration) -> Check:
    """Whether tracker, targets and zeros of joints stayed: no step in what is left, anywhere in a session."""
    name = "A tracker that stands still, targets that sit fast and joints that keep their zero"
    step = moved_during(result)
    if step is None:
        return Check("good", name, "The residuals show no step over the session.")
    return Check("bad", name, f"{step.text}.")


@lru_cache(maxsize=4)
def moved_during(result: PoseCalibration) -> Step | None:
    """What moved during a session, or None; of one calibration it is asked once."""
    problems = with_ends(result.problems, result.whole)
    return what_moved(LinearPoses.at(result.robot, problems, result.calibrations), problems, result.calibrations)


def outliers_of(result: PoseCalibration) -> tuple[Outlier, ...]:
    """What was left out, but for the poses on that side of a step, named by itself, which the fit gave up."""
    step = moved_during(result) if result.left_out else None
    if step is None:
        return result.left_out
    names = next(problem.poses.names for problem in result.whole if problem.poses.path == step.path)
    first = names.index(step.after) if step.before else 0
    given_up = set[str]()
    for side in (names[:first], names[first:]):
        out = {each.pose for each in result.left_out if each.pose in side and _is_of_step(each, step)}
        given_up |= out if len(out) > GIVEN_UP * len(side) else set()
    return tuple(each for each in result.left_out if not (_is_of_step(each, step) and each.pose in given_up))


def _is_of_step(each: Outlier, step: Step) -> bool:
    """Whether a row is one that moved: of the session, and of the target where one moved alone."""
    return each.path == step.path and (not step.target or each.target in ("", step.target))


def _geometric(result: PoseCalibration) -> set[str]:
    return {n for n in result.names if result.robot.parameters[n].unit in ("m", "rad")}


def _repeatability(result: PoseCalibration) -> Check:
    name, factor = "Residuals as the arm repeats", result.repeatability
    level = "good" if factor <= REPEATS[0] else "warn" if factor <= REPEATS[1] else "bad"
    assert result.robot.poses is not None
    setup = result.robot.poses
    repeats = float(np.median(setup.joint_sigmas))
    text = f"The residuals are those of transmissions that repeat to {significant(1e6 * repeats, 2)} urad"
    if repeats * METRE < UNSEEN * setup.target_sigma:
        noise = significant(1e3 * setup.target_sigma, 2)
        text = f"The noise of the target, {noise} mm, explains the residuals; transmissions repeat better than it shows"
    if level != "good":
        text += (
            f", {significant(factor, 2)} times what the robot file says: joints that had not settled, another "
            f"session of the "
            "tracker, or an effect that is missing"
        )
    return Check(level, name, f"{text}.")


def _turns(result: PoseCalibration) -> Check | None:
    """Whether orientations are as good as the robot file says; None where none were measured."""
    turned = [problem for problem in result.problems if np.any(problem.targets.turns)]
    if not turned or result.robot.poses is None:
        return None
    factor, count = turned[0].turning, len(summary(result.errors).turns)
    level = "good" if factor <= REPEATS[0] else "warn" if factor <= REPEATS[1] else "bad"
    text = f"{count} orientations are those of a tracker that tells them to {_mrad(result.robot.poses.turn_sigma)} mrad"
    if level != "good":
        text += (
            f", {significant(factor, 2)} times what `orientation_sigma` of the robot file says: a loose target, an "
            "orientation of another time than the position, or an effect that turns the tool and is missing"
        )
    return Check(level, "Orientations as the tracker tells them", f"{text}.")


def _mrad(angle: float) -> str:
    return significant(1e3 * angle, 2)


def _within(result: PoseCalibration) -> Check:
    name = "Errors of a size that geometry has"
    parameters = [result.robot.parameters[n] for n in result.told if n in _geometric(result)]
    sizes = {p.name: abs(p.value - p.prior) / p.prior_sigma for p in parameters}
    far = sorted((p for p in parameters if sizes[p.name] > BEYOND), key=lambda p: -sizes[p.name])
    if not far:
        return Check("good", name, "All geometric errors are of the size that the robot file expects.")
    said = (f"{p.name} ({significant(1e3 * p.value, 3)} {'mm' if p.unit == 'm' else 'mrad'})" for p in far[:3])
    contacts = any(problem.contacts for problem in result.problems)
    return Check(
        "bad" if sizes[far[0].name] > FAR[1] else "warn",
        name,
        f"{', '.join(said)} {'is' if len(far) == 1 else 'are'} beyond {BEYOND:g} times what the robot file expects "
        f"(`length_sigma`, `angle_sigma`): a wrong URDF, {'a wrong `contact_distance`, ' * contacts}or an effect that "
        "is missing.",
    )


def _near_priors(result: PoseCalibration) -> Check:
    """Of springs and all else that is no length or angle, which `_within` looks at."""
    others = [name for name in result.told if name not in _geometric(result)]
    level, text = far_parameters(result.robot.parameters, others, result.start.path.name)
    return Check(level, AS_EXPECTED_BY_PRIORS, text)


def _apart(result: PoseCalibration) -> Check | None:
    """Whether contacts are as far apart as the robot file says; None where it says nothing."""
    name, found = "Contacts as far apart as the robot file says", untold_distance(result)
    if found is None:
        return None
    level = "good" if found.distance <= APART[0] else "warn" if found.distance <= APART[1] else "bad"
    own, sigma = significant(1e3 * found.found, 4), significant(1e3 * found.sigma, 2)
    text = f"Without `contact_distance` the contacts of a place are {own} ± {sigma} mm apart"
    if level != "good":
        said = f"{significant(1e3 * found.said, 4)} mm that {result.start.path.name} says"
        text += (
            f", {significant(found.distance, 2)} sigma from the {said}: the arm was stretched to reach them; measure "
            "the distance, and correct it there"
        )
    return Check(level, name, f"{text}.")


def _lacks(result: PoseCalibration) -> Check:
    """Whether poses that were left out are met better with an effect of the catalogue."""
    name, missing = "An effect that is missing", missing_by_poses(result)
    if not missing:
        return Check("good", name, "No effect of the catalogue would meet poses that are left out better.")
    first, *others = missing
    sizes = ", ".join(significant(size, 3) for size in first.sizes)
    unit = "rad/(N m)" if first.hypothesis.kind.soft else first.hypothesis.kind.unit
    also = f"; then {', '.join(c.hypothesis.label for c in others[:2])}" if others else ""
    looks = f"What is left looks like {first.hypothesis.label}, about {sizes} {unit} (by chance: {first.p_value:.0e})"
    if moved_during(result) is not None:
        text = f"{looks}{also}, which may stand in for what moved: calibrate without that first."
        return Check("warn", name, text)
    return Check(
        "warn",
        name,
        f"{looks}{also}; other values may be wrong by many of their sigmas until it is in the model: "
        "`jointscope diagnose` with the same poses ranks what it may be, `jointscope discover` adds it.",
    )


def _backlash(result: PoseCalibration) -> Check:
    gaps = [result.robot.parameters[n] for n in result.told if n.endswith(f".{BACKLASH}")]
    sure = [p for p in gaps if p.sigma and abs(p.value) > SURE * p.sigma]
    if not sure:
        return Check("info", "Backlash", "No backlash is seen." if gaps else "The model has no backlash.")
    said = ", ".join(f"{p.name} {1e6 * p.value:.0f} +- {1e6 * (p.sigma or 0.0):.0f} urad" for p in sure)
    return Check(
        "info", "Backlash", f"{said}: gaps of half that width (stiffness is told apart from it in this estimate)."
    )


def _worth(result: PoseCalibration) -> Check:
    before, after = (summary(errors).to_json()["rms_mm"] for errors in (result.before, result.errors))
    text = (
        f"The target is {significant(before / max(after, 1e-12), 2)} times nearer than before (rms); judge it by poses "
    )
    return Check("info", "Better than before", text + "that were not fitted: jointscope compare ROBOT --poses OTHERS.")
