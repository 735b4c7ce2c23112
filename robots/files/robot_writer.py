# SPDX-License-Identifier: BSD-3-Clause
"""Writes a calibrated robot as a robot file again: same document, same comments, new numbers and their origin."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from jointscope.robots.files.robot_file import urdf_reference
from jointscope.robots.files.sections.pose_section import write_tracker
from jointscope.robots.files.sections.transmission_section import write_transmission
from jointscope.robots.model.lasting_torques import lasting_torques
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.yaml_document import dump_document


def robot_text(robot: Robot, folder: Path, provenance: Mapping[str, Any] | None = None) -> str:
    """The robot file of a robot.

    Args:
        robot: a calibrated robot; its `document` gives layout and comments.
        folder: where the file will lie; the URDF is named relative to it.
        provenance: how the numbers came about (bags with hashes, version, date); becomes the section `calibration`.

    Returns:
        YAML text.
    """
    document = copy.deepcopy(robot.document)
    document["urdf"] = urdf_reference(robot.tree.urdf, folder)
    _write_locked(document, (robot.as_filed or robot.tree).locked)
    if robot.command.held is not None:
        document["command"]["held"] = robot.command.held
    for parameter in robot.parameters.values():
        if parameter.fixed:
            _write_held(document.get("parameters", {}), parameter)
            continue
        entry = _entry(document, parameter)
        entry["value"] = _rounded(parameter.value)
        if parameter.sigma is not None:
            entry["sigma"] = _rounded(parameter.sigma, 3)
        entry.setdefault("prior", _rounded(parameter.prior))
        entry.setdefault("prior_sigma", _rounded(parameter.prior_sigma))
    write_transmission(document, robot)
    if robot.poses is not None:
        write_tracker(document["poses"], robot.poses)
    if not robot.motion:
        _write_provenance(document, provenance)
        return dump_document(document)
    for encoder in (robot.motor_encoder, robot.link_encoder):
        if encoder is not None:
            _write_sigmas(document["sensors"][encoder.name], encoder.sigmas)
    if robot.motor_current is not None and robot.motor_current.delay_sigma is not None:
        delay = document["sensors"][robot.motor_current.name].setdefault("delay", _flow({}))
        delay["value"] = _rounded(robot.motor_current.delay)
        delay["sigma"] = _rounded(robot.motor_current.delay_sigma, 3)
    for sensor in robot.accelerometers:
        bias = document["sensors"][sensor.name].setdefault("bias", _flow({}))
        bias["value"] = _row(sensor.bias)
        if sensor.bias_sigma is not None:
            bias["sigma"] = _row(sensor.bias_sigma, 3)
    for gyro in robot.gyros:
        entry = document["sensors"][gyro.name]
        bias = entry.setdefault("bias", _flow({}))
        bias["value"] = _row(gyro.bias)
        rotation = entry["R_imu_body"]
        if "prior" not in rotation:
            rotation.insert(1, "prior", _matrix(gyro.R_prior))
        rotation["value"] = _matrix(gyro.R_imu_body)
        if gyro.bias_sigma is not None:
            bias["sigma"] = _row(gyro.bias_sigma, 3)
        if gyro.R_sigma is not None:
            rotation.pop("sigma", None)
            rotation.insert(1, "sigma", _row(gyro.R_sigma, 3))
    if not robot.free_links:
        _write_noise(document["noise"], robot)
    _write_provenance(document, provenance)
    return dump_document(document)


def _write_provenance(document: Any, provenance: Mapping[str, Any] | None) -> None:
    if provenance is not None:
        document["calibration"] = _plain(provenance)


def _entry(document: Any, parameter: Parameter) -> Any:
    """Where a parameter stands; geometric errors that the file left out are written where they are found."""
    parameters = document.setdefault("parameters", CommentedMap())
    if parameter.name not in parameters:
        parameters[parameter.name] = _flow({"value": 0.0, "unit": parameter.unit, "positive": parameter.positive})
    return parameters[parameter.name]


def _write_held(parameters: Any, parameter: Parameter) -> None:
    """A value that the file looked for, and that is held now."""
    entry = parameters.get(parameter.name)
    if entry is not None and not entry.get("fixed", False):
        entry["value"] = _rounded(parameter.value, 4)
        entry["fixed"] = True


def _write_locked(document: Any, locked: Mapping[str, float]) -> None:
    """Where other joints are locked; entries that are there already stay as they are."""
    new = {joint: _rounded(position) for joint, position in locked.items()}
    if "locked" in document:
        for joint, position in new.items():
            if document["locked"].get(joint) != position:
                document["locked"][joint] = position
    elif new:
        keys = list(document)
        # behind the joints, unless a comment hangs there that belongs to what follows
        place = keys.index("joints") + 1 if "joints" not in document.ca.items else len(keys)
        document.insert(place, "locked", _flow(new))


def _write_sigmas(entry: Any, sigmas: np.ndarray) -> None:
    """Sigmas of an encoder, as they stand in the document where they have not changed; a list where they differ."""
    if np.allclose(np.broadcast_to(np.asarray(entry["sigma"], float), sigmas.shape), sigmas, rtol=1e-6, atol=0.0):
        return
    entry["sigma"] = _rounded(sigmas[0], 3) if np.ptp(sigmas) == 0.0 else _row(sigmas, 3)


def _write_noise(section: Any, robot: Robot) -> None:
    """Densities of the joints as lists, those that effects bring along by name."""
    layout, noise = robot.layout, robot.noise
    section["link_velocity"] = _row(noise.link_velocity[layout.joint_link], 4)
    motors = dict(zip(layout.motors, noise.motor_velocity, strict=True))
    before = dict(zip(layout.joints, section["motor_velocity"], strict=True))
    section["motor_velocity"] = _row(np.array([motors.get(joint, before[joint]) for joint in layout.joints]), 4)
    own = {name: v for name, v in zip(layout.links, noise.link_velocity, strict=True) if name not in layout.joints}
    own |= dict(zip(robot.memories, noise.white.memory, strict=True))
    if own:
        section["effects"] = _flow({name: _rounded(value, 4) for name, value in own.items()})
    section.pop("lasting_torques", None)
    if noise.n_lasting:
        section["lasting_torques"] = _flow(
            {"correlation_time": noise.correlation_time}
            | {name: _rounded(torque, 4) for name, torque in lasting_torques(robot).items()}
        )


def _rounded(value: float, digits: int = 9) -> float:
    """A number without the digits that nobody can measure."""
    return float(f"{float(value):.{digits}g}")


def _row(values: np.ndarray, digits: int = 9) -> CommentedSeq:
    row = CommentedSeq([_rounded(v, digits) for v in values])
    row.fa.set_flow_style()
    return row


def _matrix(values: np.ndarray) -> CommentedSeq:
    matrix = CommentedSeq([_row(row) for row in values])
    matrix.fa.set_flow_style()
    return matrix


def _flow(content: Mapping[str, Any]) -> CommentedMap:
    mapping = CommentedMap(content)
    mapping.fa.set_flow_style()
    return mapping


def _plain(value: Any) -> Any:
    """Python values as YAML nodes."""
    if isinstance(value, Mapping):
        return CommentedMap({key: _plain(v) for key, v in value.items()})
    if isinstance(value, list | tuple):
        return CommentedSeq([_plain(v) for v in value])
    return value
