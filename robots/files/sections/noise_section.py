# SPDX-License-Identifier: BSD-3-Clause
"""The section of a robot file about process noise: densities of the random torques that the estimator grants."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError
from jointscope.robots.model.lasting_torques import equation_inertias
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.yaml_section import Section

Array = NDArray[np.float64]

SMALLEST_TURNING, SMALLEST_SLIDING = 1e-3, 1e-5  # [rad/s/sqrt(s)], [m/s/sqrt(s)]
LOOSE = (0.35, 0.26)  # of links and motors: any motion can be approached with them
HINGE_DENSITY = 0.1  # [rad/s/sqrt(s)] of a soft bearing's hinges before a calibration
HINGE_LASTING = 0.1  # [rad/s^2] standard deviation of what lasts there


def noise_of(top: Section, joints: tuple[str, ...], needed: bool) -> Section:
    """The section of a robot file; an empty one where the robot needs none.

    Raises:
        RobotError: it needs one, and there is none; the message says what to write.
    """
    if not needed:
        return top.section("noise", {})
    if "noise" not in top:
        link, motor = ([density] * len(joints) for density in LOOSE)
        raise RobotError(
            f"{top.place}: 'noise' is missing; write `noise: {{estimate: true, link_velocity: {link}, motor_velocity: "
            f"{motor}}}` (densities of random torques with which recordings of motion begin; rests do not use them)"
        )
    return top.section("noise")


def process_noise(section: Section, robot: Robot) -> ProcessNoise:
    """Process noise in the order of the robot's layout; the file lists joints, and what effects bring by name.

    Args:
        section: `noise` of the robot file.
        robot: the robot with its effects.

    Raises:
        RobotError: densities that are missing, too many or not positive.
    """
    if robot.free_links:
        layout = robot.layout
        return ProcessNoise(False, "integrated", np.ones(layout.n_link), np.ones(layout.n_motor))
    model = section.text("model", "integrated", ("integrated", "independent"))
    layout, n = robot.layout, robot.n
    own = section.section("effects", {})
    added = [name for name in layout.links if name not in layout.joints]
    hinges = {name: own.number(name, HINGE_DENSITY, positive=True) for name in added}
    joints = {key: section.array(key, (n,)) for key in ("link_velocity", "motor_velocity")}
    for key, values in joints.items():
        if np.any(values <= 0):
            raise RobotError(f"{section.place}.{key}: expected numbers above zero, got {values.tolist()}")
    link = dict(zip(layout.joints, joints["link_velocity"], strict=True)) | hinges
    motor = dict(zip(layout.joints, joints["motor_velocity"], strict=True))
    memory = [own.number(label, m.noise, positive=True) for label, m in robot.memories.items()]
    own.finish()
    white = ProcessNoise(
        estimate=section.flag("estimate", True),
        model=model,
        link_velocity=np.array([link[name] for name in layout.links]),
        motor_velocity=np.array([motor[name] for name in layout.motors]),
        position=section.number("position", positive=True) if model == "independent" else 0.0,
        memory=np.array(memory),
        smallest=smallest_densities(robot),
        unseen=unseen_links(robot),
    )
    return _with_lasting(white, section, robot)


def _with_lasting(white: ProcessNoise, section: Section, robot: Robot) -> ProcessNoise:
    """With the torques that last, where the file names any."""
    if "lasting_torques" not in section:
        return white
    lasting = section.section("lasting_torques")
    time = lasting.number("correlation_time", positive=True)
    layout = robot.layout
    names = layout.rate_names[: layout.n_link + layout.n_motor]
    torques = np.array([lasting.number(name, positive=True) for name in names])
    lasting.finish()
    return white.with_lasting(time, torques / equation_inertias(robot))


def smallest_densities(robot: Robot) -> Array:
    """Densities below which none is estimated, link before motor, shape (n_link + n_motor,)."""
    slides = np.isin([*robot.layout.links, *robot.layout.motors], robot.tree.slides)
    return np.where(slides, SMALLEST_SLIDING, SMALLEST_TURNING)


def unseen_links(robot: Robot) -> Array:
    """Motors of links that got their spring as an effect and no sensor of their own, see `ProcessNoise.unseen`."""
    layout, alone = robot.layout, len(robot.sensors) == 1
    found = np.full(layout.n_link, -1)
    for link, joint in zip(layout.joint_link, robot.joints, strict=True):
        if alone and joint in layout.motors and robot.has_effect("joint_elasticity", joint):
            found[link] = layout.motors.index(joint)
    return found if np.any(found >= 0) else np.zeros(0, dtype=int)
