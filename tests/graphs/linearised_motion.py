# SPDX-License-Identifier: BSD-3-Clause
"""Robots along a smooth made-up motion, linearised: what the tests of the regressors share.

The motion is made of slow sines and friction changes its sign over some 50 mrad/s, so that the trapezoid over a step,
which the regressors use, and Simpson's rule, which the model uses, agree to 3 % in every equation.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.scoring.columns.hypotheses import hypotheses_of
from jointscope.graphs.scoring.score_columns import regressors_of
from jointscope.graphs.scoring.score_system import Segment, rows_of
from jointscope.graphs.solving.normal_equations import states_of
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.files.effect_editing import add_effect, carried_noise
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Accelerometer, Topic
from jointscope.robots.recordings.recording import Recording, Stream

READY = load_robot("doggy")
DOGGY = replace(READY, choices=replace(READY.choices, friction_sharpness=20.0))
SECONDS, START = 0.8, 1.0  # [s]


def without_coriolis():
    robot = replace(DOGGY, choices=replace(DOGGY.choices, coriolis=False))
    return replace(robot, tree=robot.tree.with_coriolis(False))


def with_a_rigid_joint():
    robot = replace(DOGGY, choices=replace(DOGGY.choices, rigid_joints=("joint2",)))
    return replace(robot, noise=carried_noise(DOGGY, robot))


def with_a_soft_bearing():
    """Two hinges before joint 1 shift every equation that comes after them."""
    return add_effect(DOGGY, "bearing_flexibility@joint1")


def with_an_accelerometer():
    """Beside its last gyro, some centimetres from the link's frame, feeling gravity."""
    source = replace(DOGGY.sensors["imu2"].source, field="linear_acceleration", unit="m/s^2")
    sensor = Accelerometer("acc", source, "imu2", 0.02, np.zeros(3), 0.5, gravity=np.array([0.0, 0.0, -9.81]))
    place = {
        name: Parameter(name, p, "m", p, 0.1, positive=False, published=p)
        for name, p in zip(sensor.lever, (0.05, -0.03, 0.08), strict=True)
    }
    return replace(DOGGY, sensors={**DOGGY.sensors, "acc": sensor}, parameters={**DOGGY.parameters, **place})


def with_a_target():
    """On its last link, seen by a tracker that is turned."""
    pose = np.array([[0.0, -1.0, 0.0, 2.0], [0.0, 0.0, -1.0, 0.5], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]])
    source = Topic("/camera", "geometry_msgs/msg/PointStamped", "point", "m")
    target = PositionTarget("target", source, "link3", np.array([0.1, 0.2, 0.9]), None, pose, "target", 1e-3)
    return replace(DOGGY, sensors={**DOGGY.sensors, "target": target})


def with_a_weight():
    """On other bodies: its own weigh nothing about its joints."""
    urdf = Path(__file__).with_name("mimicking_doggy.urdf")
    return replace(DOGGY, tree=RigidTree(urdf, DOGGY.joints, np.array([1.0, -2.0, -9.0]), locked={"ear": 0.7}))


def with_a_weight_and_encoders_alone():
    return replace(with_a_weight(), sensors={DOGGY.motor_encoder.name: DOGGY.motor_encoder})


def with_known_drives():
    known = replace(DOGGY.parameters["motor.k_pwm"], fixed=True)
    return replace(DOGGY, parameters={**DOGGY.parameters, known.name: known})


ROBOTS = {
    "doggy": DOGGY,
    "known drives": with_known_drives(),
    "without Coriolis terms": without_coriolis(),
    "joint 2 rigid": with_a_rigid_joint(),
    "soft bearing": with_a_soft_bearing(),
    "accelerometer": with_an_accelerometer(),
    "target": with_a_target(),
    "heavy": with_a_weight(),
    "heavy, without gyros": with_a_weight_and_encoders_alone(),
    "Euler": replace(DOGGY, choices=replace(DOGGY.choices, integrator="euler")),
}


def motion(robot, times, amplitude=0.4, posture=0.0):
    """Smooth states: positions are sines, velocities their exact derivatives, springs deflect by 10 mrad."""
    layout, rng = robot.layout, np.random.default_rng(7)
    x = np.zeros((len(times), layout.size))

    def sines(amplitude, frequency):
        phase = rng.uniform(0.0, 2.0 * np.pi)
        angle = 2.0 * np.pi * frequency * times + phase
        return amplitude * np.sin(angle), amplitude * 2.0 * np.pi * frequency * np.cos(angle)

    for i, name in enumerate(layout.links):
        joint = name in robot.joints
        x[:, i], x[:, layout.n_link + i] = sines(*((amplitude, 1.1 + 0.3 * i) if joint else (0.003, 2.0 + 0.5 * i)))
        x[:, i] += posture * joint
    for i, name in enumerate(layout.motors):
        link, deflection = layout.links.index(name), sines(0.01, 3.1 - 0.4 * i)
        for side, part in ((layout.q_motor, 0), (layout.v_motor, 1)):
            x[:, side.start + i] = x[:, part * layout.n_link + link] + deflection[part]
    return x


@cache
def base(name, seconds=SECONDS, **options):
    """A linearised recording of one of the robots; one gyro is sampled between the ticks."""
    robot, rng = ROBOTS[name], np.random.default_rng(3)
    ticks = START + np.arange(round(seconds * 1e3)) * 1e-3
    angle = 2.0 * np.pi * ticks[:, None] * np.array([1.3, 1.7, 2.3]) + np.array([0.3, 1.0, 2.0])
    u = 0.5 * np.sin(angle)
    streams = {"command": Stream("command", ticks, u, tuple(f"{j}.command" for j in robot.joints), "1")}
    for name_of, sensor in robot.sensors.items():
        stamps = ticks + (4e-4 if name_of == "imu2" else 0.0)
        values = rng.normal(size=(len(ticks), len(sensor.channels)))
        if sensor is robot.motor_encoder:
            values = motion(robot, ticks, **options)[:, robot.layout.motor_q]
        streams[name_of] = Stream(name_of, stamps, values, sensor.channels, "")
    problem = BagProblem.of(robot, Recording("", "", 0, streams))
    x = motion(robot, problem.timeline.ticks, **options)
    return Segment.of(problem, x, Calibration.of(robot)), x


def residuals(problem, x, calibration):
    """Whitened residuals by equation or channel, over steps or samples; NaN where a sample is left out."""
    dynamics = problem.dynamics.residual((x[:-1], x[1:]), calibration) / problem.dynamics.sigmas
    found = dict(zip(problem.dynamics.rows, dynamics.T, strict=True))
    for placed in problem.sensors:
        factor, times = placed.factor, problem.recording.streams[placed.factor.name].times
        values = factor.residual(states_of(factor, placed.ticks, x), calibration) / factor.sigmas
        for row, value in zip(factor.rows, values.T, strict=True):
            signal = found.setdefault(f"{factor.name} {row}", np.full(len(times), np.nan))
            signal[np.searchsorted(times, placed.times)] = value
    return found


def regressors(segment, hypothesis):
    """Columns of a hypothesis by equation or channel, in the order of `residuals`, one for each size."""
    found = {}
    rows = rows_of(segment, regressors_of(hypothesis, segment))
    touched = [(f, s) for (f, _, _), s in zip(segment.linearized, segment.stamps, strict=True) if f.states]
    touched = [(f, s) for f, s in touched if f.name != "initial_state"]
    touched = touched if len(rows) == len(touched) else [(f, s) for f, s in touched if f.name == "dynamics"]
    for (factor, stamps), part in zip(touched, rows, strict=True):
        for i, row in enumerate(factor.rows):
            if factor.name == "dynamics":
                signal, where = (
                    found.setdefault(row, np.zeros((len(segment.problem.dynamics), dof(hypothesis)))),
                    part.ticks,
                )
            else:
                times = segment.problem.recording.streams[factor.name].times
                signal = found.setdefault(f"{factor.name} {row}", np.zeros((len(times), dof(hypothesis))))
                where = np.searchsorted(times, stamps)
            signal[where] = part.by_size[:, i]
    return found


def dof(hypothesis):
    return len(hypothesis.sizes)


def one_hypothesis_each(name, kinds=None):
    """One hypothesis per effect and owner, in the middle of the grid of its shapes; of Stribeck curves the widest."""
    found = {}
    small = {joint: {"forward": 4e-3, "backward": 4e-3} for joint in ROBOTS[name].joints}  # well within this motion
    for hypothesis in hypotheses_of(ROBOTS[name], deflections=small):
        if kinds is None or hypothesis.here.effect.id in kinds:
            found.setdefault(hypothesis.label, []).append(hypothesis)
    middle = {
        label: hypotheses[-1 if "stribeck" in label else 0 if "limit@" in label else len(hypotheses) // 2]
        for label, hypotheses in found.items()
    }
    return [(name, hypothesis) for hypothesis in middle.values()]
