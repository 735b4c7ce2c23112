# SPDX-License-Identifier: BSD-3-Clause
"""A calibrated robot as a MuJoCo model: the bodies, drives and springs of the simulator, with the calibrated effects.

Rotors of elastic joints are bodies of their own that a tendon, the spring, joins to their links; rotors of rigid joints
are the armature. Effects that the engine has no element for are named instead.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.export.bodies_as_calibrated import bodies_as_calibrated
from jointscope.tools.export.exported import Exported, need_masses, why_not, without_noise_below_zero
from jointscope.tools.simulator.effects import simulated_effects
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.specification import (
    build_specification,
    deflection_shares,
    quaternion_wxyz,
    rotor_joint,
    transmission,
)

INERTIA = re.compile(r'diaginertia="([^"]*)"')
DIGITS = 1e-5  # relative; what rounding to six digits does to three numbers at most
TIMESTEP = 2e-4  # [s] dry friction holds as firmly as in the simulator; larger ones creep more
NO_ELEMENT = "MuJoCo has no element for its law; add it as a passive force (mjcb_passive)"


def mujoco_model(robot: Robot) -> Exported:
    """The robot as MJCF.

    Args:
        robot: as calibrated.

    Returns:
        The file; commands are in the unit of the robot's commands. Joints that are locked are part of the body before.

    Raises:
        RobotError: the robot has no equations of motion.
        SimulationError: MuJoCo is missing, cannot build it, or refuses the text.
    """
    need_masses(robot)
    settled = bodies_as_calibrated(robot)
    plain = replace(settled, effects=())
    plain, zeroed = without_noise_below_zero(plain, _never_negative(settled.effects))
    kept = [(here, _simulated(here, plain)) for here in settled.effects]
    effects = [effect for _, effect in kept if effect is not None]
    T = transmission(plain)
    for effect in effects:
        effect.couple(T)
    shares = deflection_shares(plain, T)
    spec = build_specification(plain, "dry", TIMESTEP, shares)
    spec.modelname = robot.name
    spec.compiler.degree = False
    for effect in effects:
        effect.friction, effect.shares = "dry", shares
        effect.edit(spec)
    _limit(spec, plain)  # last: a soft bearing makes its joint anew
    _read(spec, plain)
    try:
        spec.compile()
    except ValueError as err:
        raise SimulationError(f"MuJoCo cannot build robot {robot.name!r}: {str(err).splitlines()[0]}") from err
    gone = {here.label: why_not(here.effect, NO_ELEMENT) for here, effect in kept if effect is None}
    held = [here.label for here in robot.effects if here.label not in gone]
    text = _possible(spec.to_xml())
    _load(text, robot.name)
    return Exported(text, (*_base_model(plain), *held), {**_choices(robot), **gone}, zeroed)


def _load(text: str, name: str) -> None:
    """Loads what will be written: the engine rounds numbers in a file, so that compiling the specification proves less.

    Raises:
        SimulationError: MuJoCo refuses it.
    """
    try:
        load_mujoco().MjModel.from_xml_string(text)
    except ValueError as err:
        raise SimulationError(
            f"MuJoCo refuses the model of robot {name!r} that would be written: {str(err).splitlines()[0]}; "
            "nothing was written"
        ) from err


def _possible(text: str) -> str:
    """The file with inertias that bodies can have: six digits round flat ones beyond A + B = C, which is refused."""

    def rounded(found: re.Match[str]) -> str:
        inertia = [float(number) for number in found[1].split()]
        largest = int(np.argmax(inertia))
        rest = sum(inertia) - inertia[largest]
        if inertia[largest] > rest > (1.0 - DIGITS) * inertia[largest]:
            inertia[largest] = (1.0 - DIGITS) * rest
        return f'diaginertia="{" ".join(f"{number:.12g}" for number in inertia)}"'

    return INERTIA.sub(rounded, text)


def _form(here: EffectAt) -> type[SimulatedEffect] | None:
    """The engine's form of an effect; None where it needs more than elements of the model."""
    form = simulated_effects().get(here.effect.id)
    return form if form is not None and form.built_in else None


def _simulated(here: EffectAt, robot: Robot) -> SimulatedEffect | None:
    """The same with the values of the robot."""
    form = _form(here)
    if form is None:
        return None
    return form(here.owner, here.own(robot.values), robot)


def _never_negative(effects: Sequence[EffectAt]) -> list[str]:
    """Full names of the parameters that the engine allows no negative values for."""
    forms = [(here, form) for here in effects if (form := _form(here))]
    return [here.parameter(name) for here, form in forms for name in form.never_negative]


def _base_model(robot: Robot) -> tuple[str, ...]:
    elastic = [joint for joint in robot.joints if joint in robot.layout.motors]
    springs = (f"springs of {', '.join(elastic)} (tendons JOINT.spring)",) if elastic else ()
    return ("bodies", "rotor inertias", "dry friction", "drives (actuators JOINT.drive)", *springs)


def _choices(robot: Robot) -> dict[str, str]:
    """What the engine has of its own where the model of the calibration has something else."""
    found = {}
    if not robot.choices.coriolis:
        found["no Coriolis torques"] = "the model leaves them out, and MuJoCo always has them"
    if robot.choices.friction_velocity == "link":
        found["friction of the link's velocity"] = "it is that of the rotor's velocity in the file"
    bounded = [f"{joint} {effort:g} {robot.unit_at(joint, 'N m')}" for joint, effort in _bounded(robot).items()]
    if bounded:
        found["torques beyond the limits of the URDF"] = (
            f"drives give at most {', '.join(bounded)}; where yours gave more in the recording, raise `effort` in the "
            "URDF, or actuatorfrcrange in the file"
        )
    found["shapes"] = "bodies have no meshes; attach those of your URDF"
    return found


def _limit(spec: Any, robot: Robot) -> None:
    """Ranges of the joints and torques of the drives, where the URDF has them."""
    for joint, effort in _bounded(robot).items():
        rotor = spec.joint(rotor_joint(robot, joint))
        rotor.actfrcrange, rotor.actfrclimited = [-effort, effort], True
    for joint, limits in zip(robot.joints, robot.tree.limits, strict=True):
        if np.all(np.isfinite(limits)):
            hinge = spec.joint(joint)
            hinge.range, hinge.limited = limits, True


def _bounded(robot: Robot) -> dict[str, float]:
    """Largest torque of each drive that the URDF limits [N m] or [N]."""
    limits = zip(robot.joints, robot.tree.effort_limits, strict=True)
    return {joint: float(effort) for joint, effort in limits if 0.0 < effort < np.inf}


def _read(spec: Any, robot: Robot) -> None:
    """Sensors: encoders of the motors, and IMUs turned as they are mounted."""
    mujoco = load_mujoco()
    for joint in robot.joints:
        spec.add_sensor(
            name=f"{joint}.encoder",
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=rotor_joint(robot, joint),
        )
    mounts = {gyro.name: gyro for gyro in robot.gyros}
    for gyro in robot.gyros:
        spec.site(gyro.name).quat = _mounted(robot, gyro.body, gyro.R_imu_body)
        spec.add_sensor(
            name=gyro.name, type=mujoco.mjtSensor.mjSENS_GYRO, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=gyro.name
        )
    for sensor in robot.accelerometers:
        gyro = mounts[sensor.gyro]
        spec.site(sensor.name).quat = _mounted(robot, gyro.body, gyro.R_imu_body)


def _mounted(robot: Robot, body: str, R_imu_body: NDArray[np.float64]) -> NDArray[np.float64]:
    placement = robot.tree.model.frames[robot.tree.frame_id(body)].placement
    return quaternion_wxyz(placement.rotation @ R_imu_body.T)
