# SPDX-License-Identifier: BSD-3-Clause
"""The shaken TX90L as motion in the time domain: the first seconds of a pose, with bearings rigid or soft."""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main

PARTS = ("stiffness", "damping", "inertia", "coulomb_torque", "motor_viscous.coefficient")
HEAD = """\
format: 1
name: shaken
urdf: {urdf}
gravity: [0.0, 0.0, -9.81]
joints: [joint1, joint2, joint3]
locked: {{joint4: 1.2, joint5: 1.0, joint6: 0.3}}
model: {{integrator: simpson}}
command: {{topic: /joint_states, type: sensor_msgs/msg/JointState, field: effort, unit: N m, held: false}}
sensors:
  motor_encoder: {{kind: motor_encoder, topic: /joint_states, type: sensor_msgs/msg/JointState, field: position,
                  unit: rad, sigma: 1.0e-6}}
noise: {{estimate: true, link_velocity: [0.35, 0.35, 0.35], motor_velocity: [0.26, 0.26, 0.26]}}
effects: [motor_viscous@joint1, motor_viscous@joint2, motor_viscous@joint3]
parameters:
"""
SOFT = [f"bearing_flexibility@joint{j}" for j in (1, 2, 3)]


def motion_row(robot: Robot, bag: Path, seconds: float) -> tuple[dict[str, float], str]:
    """Values of drives with rigid bearings, and how the calibration with soft ones ends.

    Args:
        robot: the TX90L, for its start values.
        bag: of a pose.
        seconds: of it that are used.
    """
    with tempfile.TemporaryDirectory() as folder:
        rigid, soft = Path(folder) / "rigid.yaml", Path(folder) / "soft.yaml"
        rigid.write_text(HEAD.format(urdf=robot.tree.urdf) + _parameters(robot), encoding="utf-8")
        with contextlib.redirect_stdout(io.StringIO()):
            main(["add", str(rigid), *SOFT, "-o", str(soft)])
        arm = load_robot(rigid)
        values = calibrate(arm, [_first(read_recording(bag, arm), seconds)]).robot.parameters
        arm = _as_table(load_robot(soft), robot)
        try:
            calibrate(arm, [_first(read_recording(bag, arm), seconds)])
            ends = "comes to rest"
        except JointscopeError as err:
            ends = f"ends with: {str(err).partition(';')[0]}"
    return {name: p.value for name, p in values.items()}, ends


def _parameters(robot: Robot) -> str:
    lines = []
    for name, p in robot.parameters.items():
        if name.partition(".")[2] in PARTS:
            known = "fixed: true" if p.fixed else f"prior_sigma: {p.prior_sigma!r}"
            lines.append(f"  {name}: {{value: {p.prior!r}, unit: {p.unit}, {known}}}\n")
    return "".join(lines)


def _as_table(soft: Robot, robot: Robot) -> Robot:
    """Bearings begin where the robot file of the TX90L has them."""
    begin: Mapping[str, float] = {
        f"joint{j}.bearing_flexibility.{part}_{axis}": value
        for j in (1, 2, 3)
        for axis in "xy"
        for part, value in (
            ("compliance", 1.0 / robot.parameter(f"joint{j}.bearing.stiffness_{axis}").prior),
            ("damping", robot.parameter(f"joint{j}.bearing.damping_{axis}").prior),
        )
    }
    parameters = dict(soft.parameters)
    for name, value in begin.items():
        parameters[name] = replace(parameters[name], value=value, prior=value, prior_sigma=1.1 * value)
    return replace(soft, parameters=parameters)


def _first(recording: Recording, seconds: float) -> Recording:
    streams = {}
    for name, s in recording.streams.items():
        used = s.times < s.times[0] + seconds
        received = None if s.received is None else s.received[used]
        streams[name] = replace(s, times=s.times[used], values=s.values[used], received=received)
    return replace(recording, streams=streams)
