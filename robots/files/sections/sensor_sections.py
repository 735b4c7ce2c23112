# SPDX-License-Identifier: BSD-3-Clause
"""The sections of a robot file that say where a signal is recorded and what a sensor is like."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import (
    BY_MESSAGE,
    RIGHT_FROM_LEFT,
    Accelerometer,
    Gyro,
    LinkEncoder,
    MotorEncoder,
    Sensor,
    Topic,
    TorqueSensor,
)
from jointscope.robots.units import UNITS, si_unit
from jointscope.robots.yaml_section import Section

Array = NDArray[np.float64]

GYRO_FORMS = ("full", "vertical", "relative")
KINDS = ("motor_encoder", "link_encoder", "joint_torque", "motor_current", "gyro", "accelerometer", "position_target")
UNKNOWN = "unknown"
LONGEST_DELAY = 0.1  # [s] of currents; beyond it a number was meant in milliseconds


def topic(section: Section, joints: tuple[str, ...] = (), units: tuple[str, ...] = (), scaled: bool = False) -> Topic:
    """Where a signal is in a recording.

    Args:
        section: with topic, type, field, unit and names.
        joints: names to expect where the signal has one channel per joint.
        units: units to choose from; all known ones if empty.
        scaled: whether each joint may have a factor of its own, such as the ratio of its gear.

    Raises:
        RobotError: another number of names, or of sensors with stamps, than of joints.
    """
    known = units or tuple(UNITS)
    each = _unit_of_each(section, joints, known) if scaled else ()
    unit = each[0] if each else section.text("unit", choices=known)
    names = section.texts("names", joints)
    if joints and len(names) != len(joints):
        raise RobotError(f"{section.place}.names: expected {len(joints)} names, one per joint, got {len(names)}")
    scale = tuple(section.array("scale", (len(joints),), np.ones(len(joints))).tolist()) if scaled else ()
    if 0.0 in scale:
        raise RobotError(f"{section.place}.scale: expected numbers other than zero, got {list(scale)}")
    wraps = section.number("wraps", None, positive=True) if scaled else None
    place = section.text("topic"), section.text("type"), section.text("field")
    return Topic(*place, unit, names, scale, wraps or 0.0, each, _stamped_by(section, joints))


def topic_or_usual(section: Section, key: str, usual: Topic, joints: tuple[str, ...]) -> Topic:
    """A topic of a section, or the usual one where the section names none; arguments and errors as of `topic`."""
    if key not in section:
        return replace(usual, names=joints)
    return topic(section.section(key), joints, scaled=bool(joints))


def _stamped_by(section: Section, joints: tuple[str, ...]) -> tuple[str, ...]:
    """The sensor with the stamps of each joint; empty where the message has those of all."""
    sensors = section.texts("stamped_by", ()) if joints else ()
    if sensors and len(sensors) != len(joints):
        raise RobotError(
            f"{section.place}.stamped_by: expected a sensor, or {BY_MESSAGE!r}, for each of the {len(joints)} joints, "
            f"got {len(sensors)}"
        )
    return sensors if any(sensor != BY_MESSAGE for sensor in sensors) else ()


def _unit_of_each(section: Section, joints: tuple[str, ...], known: tuple[str, ...]) -> tuple[str, ...]:
    """Units given joint by joint, as turning and sliding ones need; empty where there is one for all."""
    if isinstance(section.raw("unit"), str) or "unit" not in section:
        return ()
    each = section.texts("unit")
    wrong = [unit for unit in each if unit not in known]
    if wrong or len(each) != len(joints):
        got = repr(wrong[0]) if wrong else f"{len(each)} units"
        raise RobotError(f"{section.place}.unit: expected one unit or {len(joints)} of {', '.join(known)}, got {got}")
    return each


def sensor(name: str, joints: tuple[str, ...]) -> Callable[[Section], Sensor]:
    """What makes a sensor of its section.

    Args:
        name: of the sensor.
        joints: names of the robot's joints.
    """

    def make(section: Section) -> Sensor:
        kind = section.text("kind", choices=KINDS)
        if kind == "gyro":
            return _gyro(name, section)
        if kind == "accelerometer":
            return _accelerometer(name, section)
        if kind == "position_target":
            return _position_target(name, section)
        if kind == "motor_current":
            return _motor_current(name, section, joints)
        if kind == "joint_torque":
            return _torque_sensor(name, section, joints)
        return (_motor_encoder if kind == "motor_encoder" else _link_encoder)(name, section, joints)

    return make


def _position(section: Section, joints: tuple[str, ...]) -> tuple[Topic, Array]:
    """Topic of an encoder, and its sigma for each joint: one number for all, or a list."""
    source = topic(section, joints, scaled=True)
    for unit in source.bag_units(len(joints)):
        if si_unit(unit) not in ("rad", "m"):
            raise RobotError(f"{section.place}.unit: an encoder measures an angle or a length, got {unit!r}")
    return source, _sigmas(section, joints)


def _sigmas(section: Section, joints: tuple[str, ...]) -> Array:
    """Noise of each joint, shape (n,): one number for all, or a list."""
    if not isinstance(section.raw("sigma"), Sequence):
        return np.full(len(joints), section.number("sigma", positive=True))
    sigmas = section.array("sigma", (len(joints),))
    if np.any(sigmas <= 0.0):
        raise RobotError(f"{section.place}.sigma: expected numbers above zero, got {sigmas.tolist()}")
    return sigmas


def _motor_encoder(name: str, section: Section, joints: tuple[str, ...]) -> MotorEncoder:
    source, sigmas = _position(section, joints)
    zero_known = section.raw("zero") != UNKNOWN
    zero = section.array("zero", (len(joints),), np.zeros(len(joints))) if zero_known else np.zeros(len(joints))
    return MotorEncoder(name, source, sigmas, zero, joints, section.flag("estimate_sigma", True), zero_known)


def _link_encoder(name: str, section: Section, joints: tuple[str, ...]) -> LinkEncoder:
    source, sigmas = _position(section, joints)
    zero = section.array("zero", (len(joints),), np.zeros(len(joints)))
    return LinkEncoder(name, source, sigmas, zero, joints, section.flag("estimate_sigma", True))


def _torque_sensor(name: str, section: Section, joints: tuple[str, ...]) -> TorqueSensor:
    source = topic(section, joints, scaled=True)
    if source.unit != "N m":
        raise RobotError(f"{section.place}.unit: expected 'N m', got {source.unit!r}")
    return TorqueSensor(name, source, section.number("sigma", positive=True), joints)


def _motor_current(name: str, section: Section, joints: tuple[str, ...]) -> MotorCurrent:
    source = topic(section, joints, scaled=True)
    wrong = next((unit for unit in source.bag_units(len(joints)) if si_unit(unit) != "A"), None)
    if wrong is not None:
        raise RobotError(
            f"{section.place}.unit: a current is in A or mA, got {wrong!r}; of a torque that the drive works out from "
            "its current, write A: what one unit makes is a parameter of its own"
        )
    if source.wraps:
        raise RobotError(f"{section.place}.wraps: a current does not begin anew like a counter; remove it")
    given = section.raw("delay")
    if given is not None and not isinstance(given, Mapping):
        raise RobotError(f"{section.place}.delay: expected a value in seconds, as {{value: 0.003}}, got {given!r}")
    delay = section.section("delay", {"value": 0.0})
    found = MotorCurrent(
        name=name,
        source=source,
        sigmas=_sigmas(section, joints),
        joints=joints,
        delay=delay.number("value", 0.0),
        delay_sigma=delay.number("sigma", None, positive=True),
        estimate_delay=section.flag("estimate_delay", True),
    )
    delay.finish()
    if abs(found.delay) > LONGEST_DELAY:
        raise RobotError(
            f"{section.place}.delay.value: expected seconds, at most {LONGEST_DELAY:g}, got {found.delay:g}; "
            "3 ms are 0.003"
        )
    return found


def _vectors(section: Section, unit: str, expected: str) -> Topic:
    """Topic of a sensor with three axes, which are right-handed whatever the driver sends."""
    source = topic(section)
    if si_unit(source.unit) != unit:
        raise RobotError(f"{section.place}.unit: {expected}, got {source.unit!r}")
    return replace(source, scale=RIGHT_FROM_LEFT) if section.flag("left_handed", False) else source


def _gyro(name: str, section: Section) -> Gyro:
    source = _vectors(section, "rad/s", "a gyroscope measures an angular rate")
    form = section.text("form", "full", GYRO_FORMS)
    bias = section.section("bias", {"value": [0.0, 0.0, 0.0]})
    rotation = section.section("R_imu_body")
    R = _rotation(rotation.array("value", (3, 3)), rotation.place)
    gyro = Gyro(
        name=name,
        source=source,
        body=section.text("body"),
        form=form,
        sigma=section.number("sigma", positive=True),
        bias=bias.array("value", (3,)),
        bias_prior_sigma=bias.number("prior_sigma", 0.1, positive=True),
        R_imu_body=R,
        R_prior=_rotation(rotation.array("prior", (3, 3), R), rotation.place),
        R_prior_sigma=rotation.number("prior_sigma", 0.1, positive=True),
        reference=section.text("reference") if form == "relative" else None,
        bias_sigma=bias.array("sigma", (3,), None),
        R_sigma=rotation.array("sigma", (3,), None),
        left_handed=section.flag("left_handed", False),
    )
    bias.finish()
    rotation.finish()
    return gyro


def _accelerometer(name: str, section: Section) -> Accelerometer:
    source = _vectors(section, "m/s^2", "an accelerometer gives m/s^2 or g")
    bias = section.section("bias", {"value": [0.0, 0.0, 0.0]})
    found = Accelerometer(
        name=name,
        source=source,
        gyro=section.text("gyro"),
        sigma=section.number("sigma", positive=True),
        bias=bias.array("value", (3,)),
        bias_prior_sigma=bias.number("prior_sigma", 0.5, positive=True),
        bias_sigma=bias.array("sigma", (3,), None),
        gravity=section.array("gravity", (3,), None),
    )
    bias.finish()
    return found


def _position_target(name: str, section: Section) -> PositionTarget:
    source = _vectors(section, "m", "a position is in m or mm")
    if len(source.names) > 1:
        raise RobotError(
            f"{section.place}.names: expected one name, the child_frame_id of this target, got {len(source.names)}"
        )
    tracker, pose = section.text("tracker", None), section.array("tracker_pose", (4, 4), None)
    if (tracker is None) == (pose is None):
        raise RobotError(
            f"{section.place}: the frame of the marker is {'unknown' if pose is None else 'given twice'}; say where "
            "the tracker stands: `tracker:` with a link fixed to the base or with another sensor of kind "
            "position_target that has the same tracker, or `tracker_pose:` with a matrix 4 x 4, base from tracker"
        )
    if pose is not None:
        place = f"{section.place}.tracker_pose"
        if not np.array_equal(pose[3], [0.0, 0.0, 0.0, 1.0]):
            raise RobotError(f"{place}: expected a last row [0, 0, 0, 1], got {pose[3].tolist()}")
        pose[:3, :3] = _rotation(pose[:3, :3], place)
    unknown = np.full((4, 4), np.nan)
    return PositionTarget(
        name=name,
        source=source,
        body=section.text("target"),
        at=section.array("at", (3,), np.zeros(3)),
        tracker_link=tracker,
        tracker_pose=unknown if pose is None else pose,
        tracker=name,
        sigma=section.number("sigma", positive=True),
    )


def _rotation(R: Array, place: str) -> Array:
    """The rotation nearest to a printed matrix, which has few digits."""
    U, _, Vt = np.linalg.svd(R)
    nearest = U @ Vt
    if np.linalg.det(nearest) < 0 or np.abs(nearest - R).max() > 0.02:
        mirrored = np.linalg.det(R) < -0.9
        hint = "; axes that are left-handed: negate the first row and set `left_handed: true`" if mirrored else ""
        raise RobotError(
            f"{place}: not a rotation matrix (determinant {np.linalg.det(R):.3f}); expected R R^T = 1{hint}"
        )
    return nearest
