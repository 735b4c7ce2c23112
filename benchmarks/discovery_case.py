# SPDX-License-Identifier: BSD-3-Clause
"""Simulates one case, lets `discover` look for what is missing, and holds the answer against the truth."""

from __future__ import annotations

import io
import tempfile
import time
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from discovery_row import Row
from hidden_axes import HiddenAxis, record_hidden
from hidden_axes import true_sizes as hidden_sizes
from hidden_effects import FAR_START, LEFT_OUT, TEST, TRAIN, AnyCase, Case
from setting_arms import TEST as ARM_TEST
from setting_arms import TRAIN as ARM_TRAIN
from setting_arms import SettingCase, arm_model, record_arm, true_sizes
from spring_axes import SpringAxis, record_axis

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.comparison.compare import compare_model
from jointscope.graphs.discovery.diagnose import LOOK_FIRST
from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.graphs.discovery.discover import discover
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main
from jointscope.tools.simulator import Disturbance, simulate

FAR = 3.0  # times the values of the robot file
LEADERS = 5  # candidates that are kept in a row


@dataclass(frozen=True)
class Recordings:
    """What a case is judged with.

    Attributes:
        train: calibration motion.
        test: other motion of the same robot; never used to choose.
        parameters: true values by full name.
    """

    train: Recording
    test: Recording
    parameters: dict[str, Any]


def run_case(case: AnyCase) -> Row:
    """One row of the table; an error of the project becomes part of the row."""
    if isinstance(case, SettingCase):
        model, recordings = _arm(case)
    elif isinstance(case, SpringAxis | HiddenAxis):
        model, recordings = _axis(case)
    else:
        model, recordings = _model(case), _simulate(case)
    began = time.perf_counter()
    try:
        found = discover(model, [recordings.train], holdout=recordings.test, missing_torque=False)
    except JointscopeError as err:
        seconds = time.perf_counter() - began
        return Row(case.name, case.kind, case.truth, seconds=seconds, error=str(err).splitlines()[0])
    return _row(case, recordings, found, time.perf_counter() - began)


def _simulate(case: Case) -> Recordings:
    """Training and test recording of the same robot."""
    options = dict(case.options)
    seconds = options.pop("seconds", TRAIN)
    options["disturbance"] = Disturbance(**options.pop("disturbance", {}))
    robot = load_robot("doggy")
    made = [
        simulate(robot, motion, duration, case.seed, effects=case.hidden, friction="smooth", **options)
        for motion, duration in (("calibration", seconds), ("moves", TEST))
    ]
    return Recordings(made[0].recording, made[1].recording, made[0].truth["parameters"])


def _arm(case: SettingCase) -> tuple[Robot, Recordings]:
    """The arm as its file has it, and what it did with its fault."""
    with tempfile.TemporaryDirectory() as folder:
        robot, true, drive = arm_model(case, Path(folder))
    made = [record_arm(case, robot, true, drive, seconds, i) for i, seconds in enumerate((ARM_TRAIN, ARM_TEST))]
    return robot, Recordings(*made, true_sizes(case, robot))


def _axis(axis: SpringAxis | HiddenAxis) -> tuple[Robot, Recordings]:
    """The axis as `init` makes it out, and what it did."""
    with tempfile.TemporaryDirectory() as name:
        folder, seconds = Path(name), (ARM_TRAIN, ARM_TEST)
        record = record_hidden if isinstance(axis, HiddenAxis) else record_axis
        bags = [record(axis, folder, duration, i) for i, duration in enumerate(seconds)]
        path = folder / "axis.yaml"
        with redirect_stdout(io.StringIO()):
            main(["init", str(folder / "axis.urdf"), str(bags[0]), "--unit", "Nm", "-o", str(path)])
        robot = load_robot(path)
        made = [read_recording(bag, robot) for bag in bags]
    if isinstance(axis, HiddenAxis):
        return robot, Recordings(*made, hidden_sizes(axis))
    true = {"axis.joint_elasticity.compliance": axis.compliance} if axis.frequency else {}
    return robot, Recordings(*made, true)


def _model(case: Case) -> Robot:
    """The ready robot without what the case leaves out, from start values that are far off where it says so."""
    robot = load_robot("doggy")
    if case.circumstance == FAR_START:
        return robot.with_values({n: FAR * p.value for n, p in robot.parameters.items() if not p.fixed})
    if not case.left_out:
        return robot
    text = robot.path.read_text(encoding="utf-8").replace("urdf: doggy.urdf", f"urdf: {robot.tree.urdf.resolve()}")
    for label in case.left_out:
        before, after = LEFT_OUT[label]
        assert text.count(before) == 1, f"{robot.path} has no single line with {before!r}"
        text = text.replace(before, after)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "doggy.yaml"
        path.write_text(text, encoding="utf-8")
        return load_robot(str(path))


def _row(case: AnyCase, recordings: Recordings, found: Discovery, seconds: float) -> Row:
    diagnosis = found.steps[0].diagnosis
    labels = [candidate.label for candidate in diagnosis.candidates] if diagnosis else []
    accepted = _accepted(found)
    return Row(
        case.name,
        case.kind,
        case.truth,
        ranks=tuple(labels.index(label) + 1 if label in labels else 0 for label in case.truth),
        first=labels[0] if labels else "",
        look_alike=_alike(diagnosis, case.truth) if diagnosis else False,
        accepted=accepted,
        numerics=_numerics(found, accepted),
        base_error=_or_none(found.steps[0].heldout_error),
        final_error=_or_none(found.steps[-1].heldout_error),
        true_error=_true_error(case, recordings, found, accepted),
        floor=_or_none(found.steps[-1].floor),
        z=_deviations(case, recordings, found.robot),
        adequate=found.adequate,
        seconds=seconds,
        stages=dict(diagnosis.wall_seconds) if diagnosis else {},
        suspicions=tuple(p for p in diagnosis.paragraphs if p.startswith(LOOK_FIRST)) if diagnosis else (),
        leaders=tuple(map(_leader, diagnosis.candidates[:LEADERS])) if diagnosis else (),
        stop=found.stop_reason,
    )


def _leader(candidate: Candidate) -> str:
    """One of the best candidates in one line."""
    share = f", explains {100 * candidate.share:.1f} %" if candidate.refitted else ""
    return f"{candidate.label}: {candidate.verdict}, score {candidate.score:.3g}{share}"


def _accepted(found: Discovery) -> tuple[str, ...]:
    """What the last model has beyond the base model."""
    labels: list[str] = []
    for step in found.steps:
        if step.added:
            labels.append(step.added)
        if step.removed in labels:
            labels.remove(step.removed)
    return tuple(labels)


def _numerics(found: Discovery, accepted: tuple[str, ...]) -> tuple[str, ...]:
    every = [c for step in found.steps if step.diagnosis for c in step.diagnosis.candidates]
    return tuple(label for label in accepted if any(c.numerics and c.label == label for c in every))


def _alike(diagnosis: Diagnosis, truth: tuple[str, ...]) -> bool:
    """Whether the best candidate and a true effect cannot be told apart in this recording, says the diagnosis."""
    if not diagnosis.candidates:
        return False
    first = diagnosis.candidates[0]
    true_ones = [c for c in diagnosis.candidates if c.label in truth]
    return any(c.label in first.look_alikes or first.label in c.look_alikes for c in true_ones)


def _true_error(case: AnyCase, recordings: Recordings, found: Discovery, accepted: tuple[str, ...]) -> float | None:
    """Held-out error of the true structure, calibrated with the same recording; None where there is no such model."""
    if not isinstance(case, Case) or case.kind in ("outside", "mistake"):
        return None
    if set(accepted) == set(case.truth):
        return _or_none(found.steps[-1].heldout_error)
    try:
        robot = load_robot("doggy")
        for text in case.hidden:
            robot = add_effect(robot, text.split(":")[0])
        return compare_model("truth", calibrate(robot, [recordings.train]).robot, recordings.test).error
    except JointscopeError:
        return None


def _deviations(case: AnyCase, recordings: Recordings, robot: Robot) -> dict[str, float]:
    """(estimate - truth) / sigma of the parameters of true effects in the last model."""
    found = {}
    for label in case.truth:
        effect, owner = label.split("@")
        prefix = f"{owner}.{effect}."
        for name, parameter in robot.parameters.items():
            if name.startswith(prefix) and name in recordings.parameters and parameter.sigma:
                found[name] = (parameter.value - float(recordings.parameters[name])) / parameter.sigma
    return found


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
