# SPDX-License-Identifier: BSD-3-Clause
"""The signature of an effect as a picture: what a model without it leaves in its residuals, along a made-up motion.

A ready robot moves along sines that its springs follow. The regressor of the effect, as the score test has it, times
the sizes of its example is what the equations of motion and the readings of the sensors lack, before other parameters
take their part of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis, hypotheses_of
from jointscope.graphs.scoring.score_columns import regressors_of
from jointscope.graphs.scoring.score_system import Segment, rows_of
from jointscope.robots.effect_kinds.effect import Effect
from jointscope.robots.files.effect_editing import remove_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.report.page.picture import picture
from jointscope.tools.report.page.plot import Axes, Curve, plot
from jointscope.tools.report.page.stacked import stacked

Array = NDArray[np.float64]

ROBOTS = ("doggy", "doggy_paper", "biorob", "xl330_pendulum")
"""The first of them that may lack an effect is drawn; if there is none, the first that has it, without it."""
SECONDS, STEP = 2.4, 2e-3  # [s]
SWAY, QUIVER = 0.4, 0.01  # [rad] of the slow and of the fast part of the motion
SLOW, FAST = 0.6, 5.0  # [Hz] of the first joint; each further one is a fifth faster
TOLD = 0.2  # of the largest: rows that show less are not drawn
MOST_ROWS = 2
WIDTH, HEIGHT = 640, 120
DRAWN = 300  # points of a curve


@dataclass(frozen=True)
class _Row:
    """What one equation or channel lacks over time; `weight` is its size in sigmas."""

    name: str
    times: Array
    values: Array
    weight: float


def signature_picture(effect: Effect) -> str | None:
    """An SVG file; None for an effect that acts on none of the ready robots."""
    for name, without in [*((name, "") for name in ROBOTS), *((name, effect.id) for name in ROBOTS)]:
        hypothesis = _hypothesis(effect, name, without)
        if hypothesis is None:
            continue
        segment = _segment(name, without)
        rows = _rows(hypothesis, segment)
        if rows:
            return picture(stacked([_motion(hypothesis, segment), *map(_drawn, rows)], title=_title(hypothesis, name)))
    return None


def _title(hypothesis: EffectHypothesis, name: str) -> str:
    example = hypothesis.here.effect.example or {}
    sizes = ", ".join(f"{p.name} = {example[p.name]:g}" for p in hypothesis.sizes if p.name in example)
    return f"{hypothesis.label} of {name}{f': {sizes}' if sizes else ''}"


@cache
def _robot(name: str, without: str) -> Robot:
    """A ready robot, without an effect that it has."""
    robot = load_robot(name)
    for here in robot.effects:
        if here.effect.id == without:
            robot = remove_effect(robot, here.label)
    return robot


def _hypothesis(effect: Effect, name: str, without: str) -> EffectHypothesis | None:
    """The effect in the middle of the robot, with the shapes of the grid that are nearest to its example's."""
    example = dict(effect.example or {})
    found = [h for h in _hypotheses(name, without) if h.here.effect.id == effect.id]
    if not found:
        return None
    owners = list(dict.fromkeys(h.here.owner for h in found))
    owner = owners[len(owners) // 2]

    def off(hypothesis: EffectHypothesis) -> float:
        return sum(abs(value - example.get(shape, value)) for shape, value in hypothesis.shapes.items())

    of_owner = [h for h in found if h.here.owner == owner]
    nearest = min(of_owner, key=off)
    if nearest.shapes.keys() <= example.keys():
        return replace(nearest, shapes={shape: example[shape] for shape in nearest.shapes})
    return of_owner[len(of_owner) // 2]


@cache
def _hypotheses(name: str, without: str) -> list[EffectHypothesis]:
    return hypotheses_of(_robot(name, without))


@cache
def _segment(name: str, without: str) -> Segment:
    """The robot along the motion, linearised."""
    robot = _robot(name, without)
    ticks = np.asarray(STEP * np.arange(round(SECONDS / STEP)), np.float64)
    x, command = _along(robot, ticks)
    streams = {"command": Stream("command", ticks, command, tuple(f"{j}.command" for j in robot.joints), "")}
    for sensor in robot.sensors.values():
        values = np.zeros((len(ticks), len(sensor.channels)))
        if sensor is robot.motor_encoder:
            values = x[:, robot.layout.motor_q]
        streams[sensor.name] = Stream(sensor.name, ticks, values, sensor.channels, "")
    problem = BagProblem.of(robot, Recording("", "", 0, streams))
    return Segment.of(problem, _along(robot, problem.timeline.ticks)[0], Calibration.of(robot))


def _along(robot: Robot, times: Array) -> tuple[Array, Array]:
    """States, shape (n, d), and commands, shape (n, n_joints): springs bend by what moves the links."""
    layout = robot.layout
    x = np.zeros((len(times), layout.size))
    q = np.zeros((len(times), layout.n_link))
    for i in range(layout.n_link):
        slow, fast = (2.0 * np.pi * f * (1.0 + 0.2 * i) * times + i for f in (SLOW, FAST))
        q[:, i] = SWAY * np.sin(slow) + QUIVER * np.sin(fast)
    v = np.asarray(np.gradient(q, times, axis=0, edge_order=2))
    a = np.asarray(np.gradient(v, times, axis=0, edge_order=2))
    x[:, : layout.n_link], x[:, layout.n_link : 2 * layout.n_link] = q, v
    tau = np.einsum("kij,kj->ki", robot.tree.mass_matrix(q[:, : len(robot.joints)]), a[:, : len(robot.joints)])
    for i, joint in enumerate(layout.motors):
        link = layout.links.index(joint)
        bend = tau[:, link] / robot.parameters[f"{joint}.stiffness"].value
        x[:, layout.q_motor.start + i] = q[:, link] + bend
        x[:, layout.v_motor.start + i] = v[:, link] + np.gradient(bend, times)
    effort = tau / np.max(np.abs(tau), axis=0)
    return x, 0.4 * effort + 0.1 * np.tanh(20.0 * v[:, : len(robot.joints)])


def _rows(hypothesis: EffectHypothesis, segment: Segment) -> list[_Row]:
    """Equations and channels that lack most, the largest first."""
    example: Mapping[str, float] = hypothesis.here.effect.example or {}
    sizes = np.array([example.get(p.name, p.start) for p in hypothesis.sizes])
    pieces = rows_of(segment, regressors_of(hypothesis, segment))
    linearised = zip(segment.linearized, segment.stamps, strict=True)
    touched = [(f, stamps) for (f, _, _), stamps in linearised if f.states and f.name != "initial_state"]
    touched = touched if len(pieces) == len(touched) else [(f, s) for f, s in touched if f.name == "dynamics"]
    units = {c: u for s in segment.problem.robot.sensors.values() for c, u in zip(s.channels, s.units, strict=True)}
    parts: dict[str, list[tuple[Array, Array, Array]]] = {}
    for (factor, stamps), piece in zip(touched, pieces, strict=True):
        whitened = piece.by_size @ sizes
        values = whitened * np.broadcast_to(factor.sigmas, whitened.shape)
        times = stamps
        if factor.name == "dynamics":
            times = segment.signals.ticks[piece.ticks]
            # the residual is the motion less what the model expects, so what the effect adds to the latter is lacking
            values = -values / np.diff(segment.signals.ticks)[piece.ticks][:, None]
        for i, row in enumerate(factor.rows):
            if factor.name != "dynamics" or not row.endswith("position"):  # positions lack half a step of it
                parts.setdefault(_said(row, units), []).append((times, values[:, i], whitened[:, i]))
    found = []
    for name, of_row in parts.items():
        times, values, whitened = (np.concatenate([part[k] for part in of_row]) for k in range(3))
        order = np.argsort(times)
        found.append(_Row(name, times[order], values[order], float(np.sqrt(np.mean(whitened**2)))))
    found.sort(key=lambda row: -row.weight)
    return [row for row in found[:MOST_ROWS] if row.weight > max(TOLD * found[0].weight, 0.0)]


def _said(row: str, units: Mapping[str, str]) -> str:
    """What a row lacks, with its unit."""
    if row in units:
        return f"error of {row} [{units[row]}]"
    joint, _, kind = row.rpartition(".")
    return f"acceleration that the {kind.partition('_')[0]} of {joint} lacks [rad/s^2]"


def _motion(hypothesis: EffectHypothesis, segment: Segment) -> str:
    """The speed of the joint, or of the last where a sensor or the robot is meant."""
    robot, signals = segment.problem.robot, segment.signals
    joint = hypothesis.here.owner if hypothesis.here.owner in robot.joints else robot.joints[-1]
    speed = signals.x[:, robot.layout.n_link + robot.layout.links.index(joint)]
    axes = Axes(f"speed of {joint} [rad/s]", "", WIDTH, HEIGHT, (0.0, SECONDS), levels=((0.0, ""),))
    return plot(axes, [Curve("speed", signals.ticks, speed, "k1", points=DRAWN)])


def _drawn(row: _Row) -> str:
    axes = Axes(row.name, "time [s]", WIDTH, HEIGHT, (0.0, SECONDS), levels=((0.0, ""),))
    return plot(axes, [Curve("lacks", row.times, row.values, "k0", points=DRAWN)])
