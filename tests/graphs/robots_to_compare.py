# SPDX-License-Identifier: BSD-3-Clause
"""Robots on which fast code for one state is held against the code for many: ready ones, and one for each effect."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from pathlib import Path

import numpy as np

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect, carried_noise
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.parameter import Parameter

MIMICKING = Path(__file__).with_name("mimicking_doggy.urdf")

READY, PAPER = load_robot("doggy"), load_robot("doggy_paper")
SMOOTH = replace(READY, choices=replace(READY.choices, friction_sharpness=20.0))


def _rigid(robot, *joints):
    changed = replace(robot, choices=replace(robot.choices, rigid_joints=joints))
    return replace(changed, noise=carried_noise(robot, changed))


def _without_coriolis(robot):
    robot = replace(robot, choices=replace(robot.choices, coriolis=False))
    return replace(robot, tree=robot.tree.with_coriolis(False))


def mimicking(robot, joints):
    """The robot on other bodies: a continuous joint, links that follow, an ear that is held, gravity."""
    tree = RigidTree(MIMICKING, joints, np.array([1.0, -2.0, -9.0]), locked={"ear": 0.7})
    return replace(robot, tree=tree, joints=tuple(joints))


def without_gyros(robot):
    """The robot with its encoders alone."""
    return replace(robot, sensors={robot.motor_encoder.name: robot.motor_encoder})


def coupled(robot):
    """The robot behind a full matrix, half of whose elements are parameters, with laws on all sides of it."""
    T = np.array([[1.1, 0.0, 0.0], [0.2, 0.9, 0.0], [-0.1, 0.3, 1.0]])
    places = {"joint1.from_joint1": (0, 0), "joint2.from_joint1": (1, 0), "joint3.from_joint2": (2, 1)}
    elements = {name: Parameter(name, T[at], "rad/rad", T[at], 1.0, positive=False) for name, at in places.items()}
    return replace(robot, transmission=T, parameters={**robot.parameters, **elements})


def lasting(robot):
    """The robot with random torques that last, of another size in each equation."""
    equations = robot.layout.n_link + robot.layout.n_motor
    return replace(robot, noise=robot.noise.with_lasting(0.02, np.linspace(0.5, 2.0, equations)))


def _known_drives(robot):
    known = replace(robot.parameters["motor.k_pwm"], fixed=True)
    return replace(robot, parameters={**robot.parameters, known.name: known})


def _with(effect, robot):
    owner = effect.owners_of(robot)[-1]
    return add_effect(robot, f"{effect.id}@{owner}", dict(effect.example))


def _every():
    yield "doggy", READY
    yield "doggy_paper", PAPER
    yield "friction on links", replace(READY, choices=replace(READY.choices, friction_velocity="link"))
    yield "without Coriolis terms", _without_coriolis(READY)
    yield "joint 2 rigid", _rigid(READY, "joint2")
    yield "all joints rigid", _rigid(READY, *READY.joints)
    yield "torques that last", lasting(READY)
    yield "torques that last, joint 2 rigid", lasting(_rigid(READY, "joint2"))
    yield "torques that last and hysteresis", lasting(_with(catalogue()["hysteresis"], READY))
    bases = {
        "coriolis": _without_coriolis(READY),
        "joint_elasticity": _rigid(READY, "joint3"),
        "gravity_direction": mimicking(READY, READY.joints),
        "axis_misalignment": without_gyros(mimicking(READY, READY.joints)),
        "torque_constant_error": _known_drives(READY),
        "weight_dependent_friction": mimicking(READY, READY.joints),  # its own bodies weigh nothing about its joints
    }
    for effect in catalogue().values():
        if effect.id != "integration_error":  # it is a choice of the rule, not a term of the equations
            yield effect.id, _with(effect, bases.get(effect.id, READY))
    follows = mimicking(READY, READY.joints)
    yield "mimic joints", follows
    yield "mimic joints in another order", mimicking(READY, ("joint3", "joint1", "joint2"))
    yield "mimic joints and rigid ones", _rigid(follows, "joint1", "joint3")
    for name in ("payload", "inertia_error", "link_mass", "bearing_flexibility"):
        yield f"mimic joints and {name}", _with(catalogue()[name], follows)
    follows = _without_coriolis(follows)
    yield "mimic joints without Coriolis terms", follows
    yield "mimic joints and coriolis", _with(catalogue()["coriolis"], follows)
    bearing = catalogue()["bearing_flexibility"]
    yield "mimic joints in another order and bearing", _with(bearing, mimicking(READY, ("joint3", "joint1", "joint2")))
    yield "bearing and a rigid joint", _rigid(_with(bearing, READY), "joint2")
    for name in ("cogging", "hysteresis"):
        yield f"bearing and {name}", _with(catalogue()[name], _with(bearing, READY))
    yield "coupled joints", coupled(READY)
    yield "coupled joints and friction on links", coupled(PAPER)
    laws = ("load_dependent_friction", "spring_cubic", "hysteresis", "link_viscous", "kinematic_coupling")
    yield "coupled joints and laws", reduce(lambda robot, law: _with(catalogue()[law], robot), laws, coupled(READY))
    play = (catalogue()["backlash"], catalogue()["spring_curve"])
    yield "play before a curve", reduce(lambda robot, effect: _with(effect, robot), play, READY)
    yield "coupled joints and play before a curve", reduce(lambda robot, e: _with(e, robot), play, coupled(READY))
    yield "coupled joints and bearing", _with(bearing, coupled(READY))
    heavy = coupled(mimicking(READY, READY.joints))
    yield "coupled joints and weight", _with(catalogue()["weight_dependent_friction"], heavy)


ROBOTS = dict(_every())


def states(robot, count, seed=2):
    """Random states, fast and slow, with deflections of a few hundredths of a radian, shape (count, d)."""
    rng, layout = np.random.default_rng(seed), robot.layout
    x = np.zeros((count, layout.size))
    x[:, layout.q_link] = rng.normal(0.0, 0.02, (count, layout.n_link))
    x[:, layout.joint_q] = rng.normal(0.0, 0.5, (count, robot.n))
    x[:, layout.v_link] = rng.normal(0.0, 1.0, (count, layout.n_link)) * rng.choice([1e-3, 0.1, 2.0], (count, 1))
    elastic = layout.motor_q != layout.joint_q
    x[:, layout.motor_q[elastic]] = x[:, layout.joint_q[elastic]] + rng.normal(0.0, 0.02, (count, elastic.sum()))
    x[:, layout.motor_v[elastic]] = x[:, layout.joint_v[elastic]] + rng.normal(0.0, 0.01, (count, elastic.sum()))
    x[:, layout.memory] = rng.normal(0.0, 0.5, (count, len(layout.memories)))
    return x
