# SPDX-License-Identifier: BSD-3-Clause
"""What only a whole robot shows: sensors sit on its links, every law has its parameters, in the right unit."""

from __future__ import annotations

from jointscope.robots.errors import RobotError
from jointscope.robots.files.needed_spring import needed_spring
from jointscope.robots.files.sections.frequency_section import check_frequency, frequency_units
from jointscope.robots.files.sections.transmission_section import check_transmission, element_units
from jointscope.robots.files.spring_section import check_curves
from jointscope.robots.geometry.arm_effects import effect_units
from jointscope.robots.geometry.error_parameters import pose_units
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.robots.model.robot import SHARPNESS, Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.sensors import BY_MESSAGE, LinkEncoder, MotorEncoder, TorqueSensor
from jointscope.robots.yaml_section import did_you_mean

DRIVE_PARAMETERS = {"k_pwm": "N m/V", "k_mi": "N m s/rad", "torque_constant": "N m/A", "inertia": "kg m2"}
JOINT_PARAMETERS = {"coulomb_torque": "N m", "stiffness": "N m/rad", "damping": "N m s/rad"}
MAY_HAVE = {SHARPNESS: "s/rad"}  # beside what the model says for all joints


def check_robot(robot: Robot) -> None:
    """Checks that the parts of a robot file fit together.

    Raises:
        RobotError: a sensor on no link, no encoder, a parameter that is missing, unknown or in another unit.
    """
    place = robot.path.name
    check_frequency(robot)
    for gyro in robot.gyros:
        if gyro.body not in robot.tree.bodies:
            raise RobotError(
                f"{place}: sensors.{gyro.name}.body: no link {gyro.body!r}{did_you_mean(gyro.body, robot.tree.bodies)}"
            )
        others = [g.name for g in robot.gyros if g.name != gyro.name]
        if gyro.reference is not None and gyro.reference not in others:
            known = ", ".join(others) or "there is none"
            raise RobotError(
                f"{place}: sensors.{gyro.name}.reference: expected another gyro ({known}), got {gyro.reference!r}"
            )
    _check_accelerometers(robot, place)
    for name in (name for target in robot.targets for name in target.own if name in robot.parameters):
        if robot.parameters[name].positive:
            raise RobotError(f"{place}: parameters.{name}.positive: expected false, a place has any sign")
    _check_currents(robot, place)
    _check_names(robot, place)
    _check_stamps(robot, place)
    _check_positions(robot, place)
    _check_gyro_forms(robot, place)
    if not any(isinstance(sensor, MotorEncoder) for sensor in robot.sensors.values()):
        raise RobotError(f"{place}: sensors: none of kind motor_encoder; the motor positions are needed")
    if robot.command.unit == "duty" and "motor.supply_voltage" not in robot.constants:
        raise RobotError(f"{place}: constants: 'motor.supply_voltage' is missing; a duty cycle needs it")
    _check_links(robot, place)
    _check_springs(robot, place)
    check_transmission(robot, place)
    _check_parameters(robot, place)


def _check_accelerometers(robot: Robot, place: str) -> None:
    """An accelerometer has the gyro of its IMU and a place on the body; only equations of motion make use of it."""
    gyros = {gyro.name: gyro for gyro in robot.gyros}
    for sensor in robot.accelerometers:
        where = f"{place}: sensors.{sensor.name}"
        if robot.free_links:
            raise RobotError(f"{where}: accelerometer needs link_dynamics: model; remove the sensor, or give masses")
        if sensor.gyro not in gyros:
            known = ", ".join(gyros) or "there is none"
            raise RobotError(f"{where}.gyro: expected the gyro of the same IMU ({known}), got {sensor.gyro!r}")
        if bool(sensor.source.scale) != gyros[sensor.gyro].left_handed:
            raise RobotError(f"{where}.left_handed: expected the same as of {sensor.gyro}; both are axes of one IMU")
        if not robot.gravity_at(sensor).any() and sensor.gravity is None:
            raise RobotError(
                f"{where}.gravity: the robot's own is zero, as where springs carry the weight, and an accelerometer "
                "feels it all the same; add gravity: [0.0, 0.0, -9.81] to the sensor"
            )
        for name in sensor.lever:
            if name not in robot.parameters:
                raise RobotError(
                    f"{place}: parameters: '{name}' is missing, where {sensor.name} sits on "
                    f"{gyros[sensor.gyro].body}; write {name}: {{value: 0.0, unit: m, positive: false, "
                    "prior_sigma: 0.1}"
                )
            if robot.parameters[name].positive:
                raise RobotError(f"{place}: parameters.{name}.positive: expected false, a place has any sign")


def _check_currents(robot: Robot, place: str) -> None:
    """What turns torques into currents is known, and every constant has the sign that it can have."""
    sensor = robot.motor_current
    if sensor is None:
        return
    where = f"{place}: sensors.{sensor.name}"
    if robot.free_links:
        raise RobotError(f"{where}: currents need link_dynamics: model; remove the sensor, or give masses")
    if robot.command.source_is(sensor.source):
        raise RobotError(f"{where}: the same field as the command; a signal is a command or a measurement, not both")
    for joint in robot.joints:
        constant, back_emf, offset = sensor.of_joint(joint)
        if constant not in robot.parameters and robot.drive_gain != "torque_constant":
            unit = robot.unit_at(joint, "N m/A")
            raise RobotError(
                f"{place}: parameters: '{constant}' is missing, the torque of one ampere behind the gear; write "
                f"{constant}: {{value: 1.0, unit: {unit}, prior_sigma: 1.0}} with the data sheet's value, gear ratio "
                "times k_t"
            )
        if back_emf in robot.parameters and "k_mi" not in robot.drive_laws:
            raise RobotError(f"{place}: parameters: {back_emf} belongs to drives that take volts; remove it")
        for name, positive in ((constant, True), (back_emf, True), (offset, False)):
            if name in robot.parameters and robot.parameters[name].positive != positive:
                reason = "an offset has any sign" if name == offset else "a constant below zero is a sign: use `scale`"
                raise RobotError(f"{place}: parameters.{name}.positive: expected {str(positive).lower()}, {reason}")


def _check_links(robot: Robot, place: str) -> None:
    """What a robot with free links needs, and what only such a robot can use."""
    if robot.free_links:
        if robot.link_encoder is None:
            raise RobotError(f"{place}: model.link_dynamics: free needs a sensor of kind link_encoder, got none")
        springs = [joint for joint in robot.joints if joint not in robot.choices.rigid_joints]
        if springs:
            raise RobotError(
                f"{place}: model.link_dynamics: free begins with rigid joints; list {', '.join(springs)} under "
                "rigid_joints, and their springs as effects joint_elasticity@JOINT"
            )
        return
    if not robot.motor_encoder.zero_known:
        raise RobotError(f"{place}: sensors.{robot.motor_encoder.name}.zero: unknown needs link_dynamics: free")
    sensor, rigid = robot.torque_sensor, [joint for joint in robot.joints if joint not in robot.layout.motors]
    if sensor is not None and rigid:
        label = " ".join(f"joint_elasticity@{joint}" for joint in rigid)
        raise RobotError(
            f"{place}: sensors.{sensor.name}: a torque is measured at the spring of a joint, and {', '.join(rigid)} "
            f"has none; remove the sensor, then `jointscope add {robot_argument(robot)} {label} "
            f"-o {edited_argument(robot, 'elastic')}` and put it back there"
        )
    if sensor is not None and robot.transmission is not None:
        raise RobotError(f"{place}: sensors.{sensor.name}: not used with a section transmission; remove the sensor")


def _check_springs(robot: Robot, place: str) -> None:
    """Effects that act in a spring have one, and a spring has an inertia behind it."""
    empty = [joint for joint in robot.layout.motors if joint in robot.tree.massless]
    if empty:
        raise RobotError(
            f"{place}: {', '.join(empty)} moves no inertia in {robot.tree.urdf.name}, so nothing swings on a spring; "
            f"list {', '.join(empty)} under model.rigid_joints, or give the link a <mass> and an <inertia>"
        )
    for here in robot.effects:
        spring = needed_spring(robot, here)
        if spring:
            raise RobotError(
                f"{place}: effects: {here.label} acts in a spring, and {here.owner} is declared rigid; take "
                f"{here.label} and its parameters out, then `jointscope add` brings it with {spring}"
            )
    check_curves(robot, place)


def _check_stamps(robot: Robot, place: str) -> None:
    """Joints have their stamps from sensors that exist and that are stamped by themselves."""
    held = {"command": robot.command} | ({} if robot.controller is None else {"controller": robot.controller.source})
    for where, source in held.items():
        if source.stamped_by:
            raise RobotError(
                f"{place}: {where}.stamped_by: expected only at encoders and torques, which are interpolated; a "
                "command acts from its stamp until the next one"
            )
    sources = {f"sensors.{name}": s.source for name, s in robot.sensors.items()}
    known = [name for name, sensor in robot.sensors.items() if not sensor.source.stamped_by]
    for where, source in sources.items():
        for name in source.stamped_by:
            if name not in (BY_MESSAGE, *known):
                raise RobotError(
                    f"{place}: {where}.stamped_by: expected {BY_MESSAGE!r} or a sensor with stamps of its own, got "
                    f"{name!r}{did_you_mean(name, known)}"
                )


def _check_names(robot: Robot, place: str) -> None:
    """Sensors have names of their own, and there is one motor encoder."""
    taken = {"command", "motor", "robot", *robot.joints}
    for name in robot.sensors:
        if name in taken:
            raise RobotError(f"{place}: sensors.{name}: the name {name!r} is taken; give the sensor another one")
    encoders = [name for name, sensor in robot.sensors.items() if isinstance(sensor, MotorEncoder)]
    for kind in (LinkEncoder, MotorCurrent, TorqueSensor):
        same = [name for name, sensor in robot.sensors.items() if isinstance(sensor, kind)]
        if len(same) > 1:
            raise RobotError(f"{place}: sensors: expected at most one of each kind but gyro, got {', '.join(same)}")
    if len(encoders) > 1:
        raise RobotError(f"{place}: sensors: expected one of kind motor_encoder, got {', '.join(encoders)}")


def _check_positions(robot: Robot, place: str) -> None:
    """Encoders measure angles of joints that turn and lengths of those that slide."""
    for sensor in robot.sensors.values():
        if not isinstance(sensor, MotorEncoder | LinkEncoder):
            continue
        given = sensor.source.bag_units(robot.n)
        for joint, unit, got in zip(robot.joints, sensor.units, given, strict=True):
            if unit != robot.unit_at(joint, "rad"):
                kind, wanted = ("prismatic", "m or mm") if unit == "rad" else ("no prismatic joint", "rad, deg or turn")
                raise RobotError(
                    f"{place}: sensors.{sensor.name}.unit: {joint} is {kind} in {robot.tree.urdf.name}; expected "
                    f"{wanted} for it, got {got!r}; where joints differ give one unit for each, as unit: [rad, m]"
                )


def _check_gyro_forms(robot: Robot, place: str) -> None:
    """The forms of the paper hold only where the first joint, and no other, moves the gyro or its reference."""
    by_name = {gyro.name: gyro for gyro in robot.gyros}
    for gyro in robot.gyros:
        seat = (
            gyro if gyro.form == "vertical" else by_name.get(str(gyro.reference)) if gyro.form == "relative" else None
        )
        if seat is not None and robot.tree.joints_below(seat.body) != (0,):
            raise RobotError(
                f"{place}: sensors.{gyro.name}.form: {gyro.form} needs {seat.name} on the body that {robot.joints[0]} "
                f"moves, got {seat.body!r}; use form full"
            )


def _check_parameters(robot: Robot, place: str) -> None:
    """All parameters known, in their units, and none missing."""
    turning = next((joint for joint in robot.joints if joint not in robot.tree.slides), robot.joints[0])
    units = {f"motor.{name}": robot.unit_at(turning, unit) for name, unit in DRIVE_PARAMETERS.items()}
    for joint in robot.joints:
        for name, unit in (DRIVE_PARAMETERS | JOINT_PARAMETERS | MAY_HAVE).items():
            units[f"{joint}.{name}"] = robot.unit_at(joint, unit)
    of_effects = {
        here.parameter(p.name): p.unit for here in robot.effects for p in here.effect.parameters_at(robot, here.owner)
    }
    units |= of_effects | element_units(robot)
    units |= {name: "m" for sensor in robot.accelerometers for name in sensor.lever}
    for target in robot.targets:
        units |= target.parameters
    if robot.torque_sensor is not None:
        units |= {
            name: unit for pair in robot.torque_sensor.parameters for name, unit in zip(pair, ("1", "N m"), strict=True)
        }
    if robot.motor_current is not None:
        for joint in robot.joints:
            known = robot.motor_current.parameter_units(joint).items()
            units |= {name: robot.unit_at(joint, unit) for name, unit in known}
    of_poses = {}
    if robot.poses is not None:
        of_poses = effect_units(robot.joints) | pose_units(robot.joints, robot.poses.other_names)
    of_frequency = {} if robot.frequency is None else frequency_units(robot.joints)
    units = of_poses | of_frequency | units
    for name, parameter in robot.parameters.items():
        if name not in units:
            raise RobotError(f"{place}: parameters: unknown parameter {name!r}{did_you_mean(name, list(units))}")
        if parameter.unit != units[name]:
            raise RobotError(f"{place}: parameters.{name}.unit: expected {units[name]!r}, got {parameter.unit!r}")
    if robot.free_links:
        return
    needed = (*robot.drive_laws, "inertia")
    for joint in robot.joints:
        for name in needed:
            if not {f"{joint}.{name}", f"motor.{name}"} & set(robot.parameters):
                raise RobotError(f"{place}: parameters: 'motor.{name}' is missing, or '{joint}.{name}'")
        for name in JOINT_PARAMETERS:
            if joint in robot.choices.rigid_joints and name != "coulomb_torque":
                continue
            if f"{joint}.{name}" not in robot.parameters:
                raise RobotError(f"{place}: parameters: '{joint}.{name}' is missing")
    for name in of_effects:
        if name not in robot.parameters:
            raise RobotError(f"{place}: parameters: '{name}' is missing; its effect is listed under effects")
