# SPDX-License-Identifier: BSD-3-Clause
"""Drives and bearings of a TX90L from the bags of its frequency responses, taken as motion in the time domain.

`calibrate` alone does not get there, for four reasons, which are taken away here. The bearings of the arm turn with it,
those of `bearing_flexibility` stand: so each pose has a robot whose joints are zero where it stands. Torques of 1 kHz
that are linear between samples are 3 per cent too small at 100 Hz: so a spline halves the steps. Tilts that no sensor
sees follow a change of a value in a way that is linear only for small ones: so states are solved anew at every step of
the values. And from far (from the paper's values, or those of the logarithm) a bearing runs off to where it is rigid,
with modes that no step resolves: so it begins where the torque balance ends.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.starts.initial_guess import initial_states
from jointscope.robots.errors import SolveError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import read_recording

Array = NDArray[np.float64]
JOINTS = ("joint1", "joint2", "joint3")
LOCKED = {"joint4": 1.2, "joint5": 1.0, "joint6": 0.3}  # [rad]
EXPERIMENTS, SECONDS = (0.0, 20.0, 40.0), 2.0  # [s] of each bag: half a period of each of three experiments
DENSITY = 0.01  # [rad/s/sqrt(s)] of random torques
MOST, STEEPEST, ENOUGH = 30, 1e3, 1e-4  # steps, largest damping, and share of the cost whose fall is none
FIRST, GENTLEST = 1e-3, 1e-5  # damping
LONGEST = 1.0  # [log] of a step


def motion_values(arm: Robot, data: Path, poses: Sequence[str]) -> tuple[dict[str, float], float, int]:
    """Values by their names in frequency responses, the cost, and the number of measured angles.

    Args:
        arm: the TX90L, with the values of springs and dampers where it begins.
        data: folder with the bags.
        poses: their names.
    """
    with tempfile.TemporaryDirectory() as folder:
        problems = [problem for pose in poses for problem in _problems(arm, data / f"frequency_{pose}", Path(folder))]
    states = [initial_states(problem, Calibration.of(problem.robot)) for problem in problems]
    calibration, cost = _solved([problem.with_noise(_white(problem.robot.noise)) for problem in problems], states)
    values = dict(zip(calibration.names, calibration.values.tolist(), strict=True))
    found = {name: value for name, value in values.items() if "bearing" not in name}
    for name, value in values.items():
        joint, _, part = name.partition(".bearing_flexibility.")
        if part.startswith("compliance"):
            found[f"{joint}.bearing.stiffness{part[-2:]}"] = 1.0 / value
        elif part.startswith("damping"):
            found[f"{joint}.bearing.{part}"] = value
    return found, cost, sum(len(p.recording.streams["motor_encoder"]) * len(JOINTS) for p in problems)


def _problems(arm: Robot, bag: Path, folder: Path) -> list[BagProblem]:
    """Pieces of a bag, of a robot whose joints are zero where it stands."""
    still = _robot(arm, folder / f"{bag.name}.yaml", np.zeros(len(JOINTS)))
    whole = read_recording(bag, still)
    q = whole.streams["motor_encoder"].values.mean(axis=0)
    robot = _robot(arm, folder / f"{bag.name}.yaml", q)
    pieces = [whole.between(t, t + SECONDS) for t in EXPERIMENTS]
    return [BagProblem.of(robot, _from_zero(piece, q)) for piece in pieces]


def _from_zero(piece: Recording, q: Array) -> Recording:
    """A recording with its angles [rad] from where the robot stands, and torques at half the steps."""
    angles, torques = piece.streams["motor_encoder"], piece.streams["command"]
    times = np.linspace(torques.times[0], torques.times[-1], 2 * len(torques) - 1)
    finer = replace(torques, times=times, values=CubicSpline(torques.times, torques.values)(times), received=None)
    return replace(piece, streams={"command": finer, "motor_encoder": replace(angles, values=angles.values - q)})


def _robot(arm: Robot, path: Path, q: Array) -> Robot:
    """The arm for motion, with joints that are zero at q [rad], and soft bearings whose bodies are known."""
    urdf = path.with_suffix(".urdf")
    _write_turned(arm.tree.urdf, urdf, dict(zip(JOINTS, q, strict=True)))
    topic = "topic: /joint_states, type: sensor_msgs/msg/JointState"
    lines = [f"format: 1\nname: tx90l_motion\nurdf: {urdf.name}\ngravity: [0.0, 0.0, -9.81]"]
    lines.append(f"joints: [{', '.join(JOINTS)}]\nlocked: {{{', '.join(f'{j}: {at}' for j, at in LOCKED.items())}}}")
    lines.append(f"command: {{{topic}, field: effort, unit: N m, held: false}}\nsensors:")
    lines.append(f"  motor_encoder: {{kind: motor_encoder, {topic}, field: position, unit: rad, sigma: 1.0e-6}}")
    lines.append(f"effects: [{', '.join(f'motor_viscous@{joint}' for joint in JOINTS)}]\nparameters:")
    own = ("stiffness", "damping", "inertia", "coulomb_torque", "motor_viscous.coefficient")
    for name in (f"{joint}.{part}" for joint in JOINTS for part in own):
        p = arm.parameters[name]
        known = "fixed: true" if p.fixed else f"prior_sigma: {p.prior_sigma}"
        lines.append(f"  {name}: {{value: {p.value}, unit: {p.unit}, {known}}}")
    each = f"[{', '.join([str(DENSITY)] * len(JOINTS))}]"
    lines.append(f"noise: {{estimate: false, link_velocity: {each}, motor_velocity: {each}}}\n")
    path.write_text("\n".join(lines), encoding="utf-8")
    robot = load_robot(path)
    for joint in JOINTS:
        robot = add_effect(robot, f"bearing_flexibility@{joint}")
    return _with_bearings_of(robot, arm)


def _with_bearings_of(robot: Robot, arm: Robot) -> Robot:
    """Springs and dampers of the arm's bearings; what `bearing_flexibility` says of the bodies is theirs."""
    parameters = dict(robot.parameters)
    for joint in JOINTS:
        for axis in "xy":
            spring, damper = (arm.parameters[f"{joint}.bearing.{part}_{axis}"] for part in ("stiffness", "damping"))
            c, sigma = 1.0 / spring.value, float(spring.prior_sigma or 0.0) / spring.value**2
            for part, value, prior_sigma in (
                ("compliance", c, sigma),
                ("damping", damper.value, float(damper.prior_sigma or 0.0)),
            ):
                name = f"{joint}.bearing_flexibility.{part}_{axis}"
                own = parameters[name]
                parameters[name] = replace(own, value=value, prior=value, prior_sigma=prior_sigma)
    for name, own in parameters.items():
        if ".bearing_flexibility.inertia" in name or ".bearing_flexibility.product" in name:
            parameters[name] = replace(own, fixed=True)
    return replace(robot, parameters=parameters)


def _write_turned(urdf: Path, path: Path, angles: Mapping[str, float]) -> None:
    """A URDF whose joints are zero at these angles [rad] of another one, whose joints have no rotated origins."""
    tree = ElementTree.parse(urdf)
    for joint in tree.iter("joint"):
        name = joint.get("name", "")
        origin, axis, limit = joint.find("origin"), joint.find("axis"), joint.find("limit")
        if name in angles and origin is not None and axis is not None and limit is not None:
            along = np.array([float(part) for part in axis.get("xyz", "").split()])
            turned = Rotation.from_rotvec(angles[name] * along)
            origin.set("rpy", " ".join(repr(float(a)) for a in turned.as_euler("xyz")))
            for side in ("lower", "upper"):
                limit.set(side, repr(float(limit.get(side, "0")) - float(angles[name])))
    tree.write(path)


def _white(noise: ProcessNoise) -> ProcessNoise:
    """Random torques of one density in all equations, those of bearings, too."""
    links, motors = (np.full(len(own), DENSITY) for own in (noise.link_velocity, noise.motor_velocity))
    return replace(noise, link_velocity=links, motor_velocity=motors)


def _solved(problems: Sequence[BagProblem], states: Sequence[Array]) -> tuple[Calibration, float]:
    """Values at the least cost, half the sum of squares, and that cost."""
    robot = problems[0].robot
    at = Calibration.of(robot)
    prior = at.dynamics
    tied = np.array([robot.parameters[name].coordinate_sigma ** -2.0 for name in at.names])

    def cost_of(guess: Sequence[Array], there: Calibration) -> tuple[list[Array], float]:
        found, cost = _settled(problems, guess, there)
        return found, cost + 0.5 * float(tied @ (there.dynamics - prior) ** 2)

    (states, cost), damping = cost_of(states, at), FIRST
    for _ in range(MOST):
        H, g, chains = np.diag(tied), tied * (at.dynamics - prior), []
        for problem, x in zip(problems, states, strict=True):
            chains.append(eliminate(solve([problem], Estimate((x,), (at,)), max_iterations=0).systems[0]))
            H, g = H + chains[-1].S, g + chains[-1].s
        before = cost
        while damping < STEEPEST:
            step = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
            step /= max(float(np.abs(step).max()) / LONGEST, 1.0)
            there = at.with_points({DYNAMICS: at.dynamics + step})
            found, lower = cost_of([x + chain.states(step) for x, chain in zip(states, chains, strict=True)], there)
            if lower < cost:
                states, cost, at = found, lower, there
                break
            damping *= 10.0
        damping = max(damping / 10.0, GENTLEST)
        if before - cost < ENOUGH * before:
            break
    return at, cost


def _settled(problems: Sequence[BagProblem], states: Sequence[Array], at: Calibration) -> tuple[list[Array], float]:
    """States at the least cost for these values, and that cost, infinite where there are none."""
    found, cost = [], 0.0
    for problem, x in zip(problems, states, strict=True):
        try:
            solution = solve([problem], Estimate((x,), (at,)), hold=(DYNAMICS,))
        except SolveError:
            return list(states), np.inf
        found.append(solution.estimate.states[0])
        cost += solution.cost
    return found, cost
