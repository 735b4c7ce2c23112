# SPDX-License-Identifier: BSD-3-Clause
"""The MuJoCo model of a robot with elastic joints, built from parts that the engine already has.

Each link is a body with its joint. Each rotor is a body of its own in the world, so it feels nothing of the link's
motion but the spring: a fixed tendon of "length" q_link - q_motor with stiffness and damping; where a transmission
couples joints, several links take part in its length. The rotor of a rigid joint is the engine's armature of the
link's joint. The motor is an actuator on the rotor whose gain is the voltage constant and whose bias is the back-EMF.
Dry friction is the engine's own friction loss. No equation of motion is written here; the engine makes them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.robots.urdf.motion_axis import motion_axis
from jointscope.tools.simulator.world.inertia import full_inertia
from jointscope.tools.simulator.world.mujoco_module import load_mujoco

Array = NDArray[np.float64]
Shares = Mapping[str, Mapping[str, float]]  # of links in the deflection of each joint's spring

DRY_TIME_CONSTANT = 4e-4  # [s] of the engine's soft stiction, which turns round half of it early; two steps at 5 kHz
STIFF = (4e-4, 1.0)  # [s] time constant and damping ratio with which a mimic joint is pulled back; two steps at 5 kHz
CURVES = ("spring_cubic", "spring_curve")  # effects that bend a spring
DRY_IMPEDANCE = (0.9999, 0.9999, 0.001, 0.5, 2.0)  # almost rigid


def link_body(joint: str) -> str:
    """Name of the body that a joint moves."""
    return f"{joint}.link"


def motor_joint(joint: str) -> str:
    """Name of the hinge of an elastic joint's rotor."""
    return f"{joint}.motor"


def is_rigid(robot: Robot, joint: str) -> bool:
    """Whether nothing gives way between rotor and link."""
    return joint not in robot.layout.motors


def rotor_joint(robot: Robot, joint: str) -> str:
    """Name of the engine's joint that the rotor turns with: a hinge of its own, or that of the link."""
    return joint if is_rigid(robot, joint) else motor_joint(joint)


def transmission(robot: Robot) -> Array:
    """Joint angles per motor angle while no spring is stretched, shape (n_joints, n_joints)."""
    T = np.eye(robot.n) if robot.transmission is None else robot.transmission.copy()
    for i, joint in enumerate(robot.joints):
        for j, motor in enumerate(robot.joints):
            own = robot.parameters.get(f"{joint}.from_{motor}")
            T[i, j] = T[i, j] if own is None else own.value
    return T


def deflection_shares(robot: Robot, T: Array) -> Shares:
    """How far each spring is stretched per angle of each link, by names of joints; those of zero are left out.

    Args:
        robot: its joints.
        T: joint angles per motor angle, shape (n_joints, n_joints).
    """
    unstretched = np.linalg.solve(T, np.eye(robot.n))
    return {
        joint: {other: float(share) for other, share in zip(robot.joints, row, strict=True) if share != 0.0}
        for joint, row in zip(robot.joints, unstretched, strict=True)
    }


def build_specification(robot: Robot, friction: str, timestep: float, shares: Shares) -> Any:
    """The editable model: chain, rotors, springs, motors, one site per gyro.

    Args:
        robot: the robot with the true parameter values.
        friction: "dry" for the engine's friction loss on the rotors; anything else leaves them without friction.
        timestep: of the integration [s].
        shares: of the links in the deflections of the springs.

    Returns:
        A `mujoco.MjSpec`, not yet compiled. Joints carry the robot's joint names, rotors `rotor_joint(robot, name)`.
    """
    mujoco = load_mujoco()
    spec = mujoco.MjSpec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.timestep = timestep
    spec.option.gravity = robot.tree.gravity
    # The engine would otherwise shift a body's inertia to satisfy inequalities that the robot file has passed already.
    spec.compiler.balanceinertia = False
    _add_links(mujoco, spec, robot)
    _tie_followers(mujoco, spec, robot)
    for joint in robot.joints:
        _add_rotor(mujoco, spec, robot, joint, friction)
        if not is_rigid(robot, joint):
            _add_spring(spec, robot, joint, shares[joint])
        _add_motor(mujoco, spec, robot, joint)
    for gyro in robot.gyros:
        _add_site(spec, robot, gyro.name, gyro.body)
    bodies = {gyro.name: gyro.body for gyro in robot.gyros}
    for sensor in robot.accelerometers:
        _add_site(spec, robot, sensor.name, bodies[sensor.gyro], sensor.place(robot.parameters))
        spec.add_sensor(
            name=sensor.name,
            type=mujoco.mjtSensor.mjSENS_ACCELEROMETER,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=sensor.name,
        )
    return spec


def _add_links(mujoco: Any, spec: Any, robot: Robot) -> None:
    model = robot.tree.model
    for j in range(1, model.njoints):
        name, parent = model.names[j], model.parents[j]
        placement, inertia = model.jointPlacements[j], model.inertias[j]
        parent_body = spec.body(link_body(model.names[parent])) if parent else spec.worldbody
        body = parent_body.add_body(
            name=link_body(name),
            pos=placement.translation,
            quat=quaternion_wxyz(placement.rotation),
            explicitinertial=True,
            mass=max(inertia.mass, 1e-9),  # [kg] the engine refuses a moving body without any
            ipos=inertia.lever,
            fullinertia=full_inertia(inertia.inertia),  # about the centre of mass, in the axes of the joint
        )
        axis, turns = joint_axis(model, j)
        kind = mujoco.mjtJoint.mjJNT_HINGE if turns else mujoco.mjtJoint.mjJNT_SLIDE
        body.add_joint(name=name, type=kind, axis=axis)


def _tie_followers(mujoco: Any, spec: Any, robot: Robot) -> None:
    """Mimic joints as equations between joints, which the engine holds by forces; off by some 1e-9 rad."""
    for name, follower in robot.tree.followers.items():
        tie = spec.add_equality(
            name=f"{name} follows",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=name,
            name2=follower.leader,
            solref=STIFF,
            solimp=DRY_IMPEDANCE,
        )
        tie.data[:2] = follower.offset, follower.factor  # of a polynomial in the leader's position
        tie.data[2:5] = 0.0


def joint_axis(model: pin.Model, j: int) -> tuple[Array, bool]:
    """Axis of a joint in its own frame, and whether it turns: what pinocchio made of the URDF's <axis>."""
    column = motion_axis(model.joints[j])
    turns = bool(np.any(column[3:]))
    return (column[3:] if turns else column[:3]), turns


def _add_rotor(mujoco: Any, spec: Any, robot: Robot, joint: str, friction: str) -> None:
    inertia = robot.drive_parameter(joint, "inertia").value
    if is_rigid(robot, joint):
        hinge = spec.joint(joint)
        hinge.armature = inertia
    else:
        rotor = add_light_body(spec, motor_joint(joint), inertia)
        hinge = rotor.add_joint(name=motor_joint(joint), type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
    if friction == "dry":
        add_dry_friction(hinge, robot.parameter(f"{joint}.coulomb_torque").value)


def add_light_body(spec: Any, name: str, inertia: float) -> Any:
    """A body in the world that only turns, with the same moment of inertia [kg m2] about all axes.

    Without `ipos`, which the compiler does not need, the model that is saved as XML would lack the inertia.
    """
    return spec.worldbody.add_body(name=name, explicitinertial=True, mass=1.0, ipos=np.zeros(3), inertia=[inertia] * 3)


def _add_spring(spec: Any, robot: Robot, joint: str, shares: Mapping[str, float]) -> None:
    tendon = add_tendon(spec, spring_tendon(joint), joint, shares)
    set_linear(tendon, "stiffness", robot.parameter(f"{joint}.stiffness").value)
    set_linear(tendon, "damping", robot.parameter(f"{joint}.damping").value)


def add_tendon(spec: Any, name: str, joint: str, shares: Mapping[str, float]) -> Any:
    """A tendon without stiffness whose length is the deflection of a joint's spring, relaxed at zero.

    Args:
        spec: the model.
        name: of the tendon.
        joint: whose motor is at its end.
        shares: of the links in its length.
    """
    tendon = spec.add_tendon(name=name)
    for link, share in shares.items():
        tendon.wrap_joint(link, share)
    tendon.wrap_joint(motor_joint(joint), -1.0)
    tendon.springlength = [0.0, 0.0]
    return tendon


def _add_motor(mujoco: Any, spec: Any, robot: Robot, joint: str) -> None:
    gain, back_emf = 1.0, 0.0
    if robot.drive_gain is not None:
        gain = robot.drive_parameter(joint, robot.drive_gain).value * robot.command_volts
    if "k_mi" in robot.drive_laws:
        back_emf = robot.drive_parameter(joint, "k_mi").value
    motor = spec.add_actuator(
        name=drive(joint),
        target=rotor_joint(robot, joint),
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
    )
    motor.gainprm[0] = gain
    motor.biasprm[2] = -back_emf


def _add_site(spec: Any, robot: Robot, name: str, body: str, p_body: Array | None = None) -> None:
    frame = robot.tree.model.frames[robot.tree.frame_id(body)]
    joint = robot.tree.model.names[frame.parentJoint]
    parent = spec.body(link_body(joint)) if frame.parentJoint else spec.worldbody
    placement = frame.placement
    place = placement.translation if p_body is None else placement.act(p_body)
    parent.add_site(name=name, pos=place, quat=quaternion_wxyz(placement.rotation))


def set_linear(element: Any, name: str, value: float) -> None:
    """Sets a stiffness or damping, which is a number in MuJoCo 3 and the coefficients of a polynomial in MuJoCo 4."""
    if np.ndim(getattr(element, name)):
        getattr(element, name)[:] = [value, 0.0, 0.0]
    else:
        setattr(element, name, value)


def add_curve(spec: Any, effect: str, joint: str, shares: Mapping[str, float], terms: tuple[float, float]) -> None:
    """Adds a tendon beside a joint's spring with the torque quadratic d^2 + cubic d^3 of the two terms.

    d is what is stretched: where the spring is slack, this one is.

    Raises:
        SimulationError: an engine that knows linear springs only.
    """
    tendon = add_tendon(spec, curve_tendon(joint, effect), joint, shares)
    if np.size(tendon.stiffness) != 3:
        raise SimulationError(f"effect {effect} needs MuJoCo 4: pip install --upgrade 'jointscope[sim]'")
    tendon.stiffness[:] = [0.0, *terms]
    tendon.springlength = spec.tendon(spring_tendon(joint)).springlength


def set_slack(spec: Any, joint: str, low: float, high: float) -> None:
    """Sets the deflections between which a joint's spring, and what `add_curve` puts beside it, are slack."""
    names = (spring_tendon(joint), *(curve_tendon(joint, effect) for effect in CURVES))
    for tendon in filter(None, map(spec.tendon, names)):
        tendon.springlength = [low, high]


def add_linear(element: Any, name: str, value: float) -> None:
    """Adds to the linear part of a stiffness or damping, see `set_linear`."""
    if np.ndim(getattr(element, name)):
        getattr(element, name)[0] += value
    else:
        setattr(element, name, getattr(element, name) + value)


def add_dry_friction(hinge: Any, torque: float) -> None:
    """Adds to the engine's friction loss of a joint [N m], and makes it as hard as can be integrated."""
    hinge.frictionloss += torque
    hinge.solref_friction = [DRY_TIME_CONSTANT, 1.0]
    hinge.solimp_friction = DRY_IMPEDANCE


def spring_tendon(joint: str) -> str:
    """Name of the tendon whose length is the deflection of a joint's spring."""
    return f"{joint}.spring"


def curve_tendon(joint: str, effect: str) -> str:
    """Name of the tendon of an effect that bends a joint's spring."""
    return f"{joint}.{effect}"


def drive(joint: str) -> str:
    """Name of a joint's motor."""
    return f"{joint}.drive"


def quaternion_wxyz(R: Array) -> Array:
    """A rotation, shape (3, 3), as the engine's quaternion, shape (4,)."""
    x, y, z, w = pin.Quaternion(R).coeffs()
    return np.array([w, x, y, z])
