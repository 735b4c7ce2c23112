# SPDX-License-Identifier: BSD-3-Clause
"""The section `transmission` of a robot file: a matrix, or the radii of the pulleys.

    transmission:
      matrix: [[1, 0], [0.2, 1]]      # joint angles = matrix times motor angles, both in the order of joints
    transmission:
      radii:                          # [m] of a rope from the motor's pulley to the joint's, over idlers on other axes
        joint1: {motor: 0.01, joint: 0.03}
        joint2: {motor: 0.01, joint: 0.03, over: {joint1: 0.005}}

With radii a rope's length says A = T^-1: its row is (over_1, ..., joint, ...) / motor. An element that is a parameter,
`joint2.from_joint1`, can be calibrated.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from jointscope.robots.dynamics.transmission import Transmission, elements
from jointscope.robots.effect_kinds.transmission_elements import FROM
from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.robots.yaml_section import Section, did_you_mean

Array = NDArray[np.float64]

WORST_CONDITION = 1e4  # of the matrix: beyond it, errors of the encoders come out that much larger


def transmission_matrix(section: Section, joints: tuple[str, ...]) -> Array | None:
    """T of the section, shape (n, n); None where it is the identity.

    Raises:
        RobotError: neither matrix nor radii or both, wrong size, singular, badly scaled.
    """
    if ("matrix" in section) == ("radii" in section):
        raise RobotError(
            f"{section.place}: expected either matrix or radii, got {', '.join(section.keys()) or 'neither'}"
        )
    n = len(joints)
    if "matrix" in section:
        T = _matrix(section, joints)
        where = f"{section.place}.matrix"
    else:
        A = section.section("radii").build(lambda s: _of_radii(s, joints))
        where = f"{section.place}.radii"
        _check_invertible(A, where, joints)
        T = np.linalg.inv(A)
    _check_invertible(T, where, joints)
    return None if np.array_equal(T, np.eye(n)) else T


def _matrix(section: Section, joints: tuple[str, ...]) -> Array:
    n, rows = len(joints), section.raw("matrix")
    sizes = [len(row) if isinstance(row, list) else 1 for row in rows] if isinstance(rows, list) else []
    if sizes != [n] * n:
        got = f"rows of {', '.join(map(str, sizes))}" if sizes else repr(rows)
        raise RobotError(
            f"{section.place}.matrix: expected {n} rows of {n} numbers, in the order {', '.join(joints)}, got {got}"
        )
    return section.array("matrix", (n, n))


def _of_radii(section: Section, joints: tuple[str, ...]) -> Array:
    A = np.eye(len(joints))
    for name, own in section.sections():
        _known(name, joints, section.place)
        row = A[joints.index(name)]
        own.build(partial(_row_of, name=name, row=row, joints=joints))
    return A


def _row_of(section: Section, name: str, row: Array, joints: tuple[str, ...]) -> None:
    """Row of A: what turns the motor's pulley while its rope is not stretched."""
    motor = section.number("motor", positive=True)
    row[joints.index(name)] = section.number("joint", positive=True) / motor
    if "over" in section:
        idlers = section.section("over")
        for other in idlers.keys():
            if other == name:
                raise RobotError(f"{idlers.place}: {name} is the rope's own joint; give its pulley as `joint`")
            row[joints.index(_known(other, joints, idlers.place))] = idlers.number(other) / motor


def _known(name: str, joints: tuple[str, ...], place: str) -> str:
    if name not in joints:
        raise RobotError(f"{place}: no joint {name!r}{did_you_mean(name, joints)}")
    return name


def _check_invertible(T: Array, where: str, joints: tuple[str, ...]) -> None:
    """Every joint can be moved, and no motor's angle is a small difference of large ones."""
    _, sizes, directions = np.linalg.svd(T)
    if sizes[-1] <= 1e-12 * sizes[0]:
        stuck = [joint for joint, share in zip(joints, directions[-1], strict=True) if abs(share) > 0.1]
        raise RobotError(
            f"{where}: singular: turning the motors of {', '.join(stuck)} together moves no joint; check signs "
            "and zeros (joint angles = matrix times motor angles)"
        )
    # units of angle and length may differ between rows and columns, that is no bad scaling
    by_column = T / np.linalg.norm(T, axis=0)
    condition = float(np.linalg.cond(by_column / np.linalg.norm(by_column, axis=1)[:, None]))
    spread = float(np.max(np.abs(T)) / np.min(np.linalg.norm(T, axis=0)))
    if condition > WORST_CONDITION or spread > WORST_CONDITION:
        raise RobotError(
            f"{where}: badly scaled (condition {max(condition, spread):.0e}, at most {WORST_CONDITION:.0e}); angles "
            "of motors are those after the gear, in link units: put gear ratios into the `scale` of encoder and command"
        )


def check_transmission(robot: Robot, place: str) -> None:
    """The transmission as a whole, parameters and effects included, fits the robot.

    Raises:
        RobotError: no inverse; rigid joints or free links behind it; a parameter that contradicts the matrix.
    """
    values = robot.values
    own, _ = elements(robot)
    fixed = np.eye(robot.n) if robot.transmission is None else robot.transmission
    for name, at in own.items():
        if abs(values[name] - fixed[at]) > 1e-6 * max(1.0, abs(fixed[at])):
            raise RobotError(
                f"{place}: parameters.{name}: {values[name]:g}, but transmission has {fixed[at]:g} in row {at[0] + 1}, "
                f"column {at[1] + 1}; make both the same"
            )
    transmission = Transmission.of(robot)
    if transmission is None:
        return
    T = transmission.matrix(values)
    _check_invertible(T, f"{place}: transmission with its parameters", robot.joints)
    if robot.free_links:
        if robot.transmission is not None or own:
            raise RobotError(f"{place}: transmission: not used with model.link_dynamics: free; take it out")
        return
    for i, joint in enumerate(robot.joints):
        if joint not in robot.layout.motors and not np.array_equal(T[i], np.eye(robot.n)[i]):
            raise RobotError(
                f"{place}: transmission: {joint} is moved by other motors or by a ratio and is declared rigid; such "
                f"joints need a spring, which `jointscope add {robot.path} joint_elasticity@{joint}` brings"
            )


def element_units(robot: Robot) -> dict[str, str]:
    """Units of the parameters that may be elements of the matrix, by name."""
    units = {True: {True: "m/m", False: "m/rad"}, False: {True: "rad/m", False: "rad/rad"}}
    slides = robot.tree.slides
    return {f"{a}.{FROM}{b}": units[a in slides][b in slides] for a in robot.joints for b in robot.joints}


def write_transmission(document: Any, robot: Robot) -> None:
    """The matrix with elements that were calibrated; one that locked springs showed first gets a section."""
    own, _ = elements(robot)
    if not own:
        return
    T = np.eye(robot.n) if robot.transmission is None else robot.transmission.copy()
    for name, at in own.items():
        T[at] = document["parameters"][name]["value"]
    section = document.setdefault("transmission", CommentedMap())
    if "matrix" not in section:  # radii cannot say what was calibrated
        section.pop("radii", None)
        rows = [CommentedSeq([float(value) for value in row]) for row in T]
        for row in rows:
            row.fa.set_flow_style()
        section["matrix"] = rows
        return
    for i, row in enumerate(T.tolist()):
        for j, value in enumerate(row):
            if section["matrix"][i][j] != value:
                section["matrix"][i][j] = value
