# SPDX-License-Identifier: BSD-3-Clause
"""Arms that MuJoCo moves: a controller's torques held from stamp to stamp, positions sampled at their own times."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from jointscope.graphs.calibration.calibration_result import ParameterEstimate
from jointscope.robots.recordings.recording import Stream

mujoco = pytest.importorskip("mujoco", reason="arms are moved by MuJoCo, which the extra `sim` brings")

STEP = 5e-4  # [s]
Drive = Callable[[float, np.ndarray, Any, Any], np.ndarray]
SHARP = 400.0  # [s/rad] of the simulated dry friction
LINK = """<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="of_{name}"/>
 <origin xyz="0 0 {place}"/><axis xyz="{axis}"/><limit effort="900" velocity="30" lower="-6" upper="6"/></joint>
<link name="of_{name}"><inertial><origin xyz="0.02 0.01 -0.18"/><mass value="{mass}"/>
 <inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""

YAML = """
format: 1
name: arm
urdf: arm.urdf
gravity: [0.0, 0.0, -9.81]
joints: [JOINTS]
model: {rigid_joints: [JOINTS]}
command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  encoder: {kind: motor_encoder, topic: /js, type: sensor_msgs/msg/JointState, field: position, unit: rad,
            sigma: 1.0e-5}
noise: {link_velocity: [NOISE], motor_velocity: [NOISE]}
effects: [EFFECTS]
parameters:
"""
VALUES = """
  jN.inertia: {value: 0.4, unit: kg m2}
  jN.coulomb_torque: {value: 1.0, unit: N m}
  jN.motor_viscous.coefficient: {value: 1.0, unit: N m s/rad, prior: 0.0, prior_sigma: 50.0, positive: false}
"""


@dataclass(frozen=True)
class Arm:
    """What moves: axes of the joints ("x", "y", "z"; "X" for one that slides), and what the drives are.

    Attributes:
        axes: one letter for each joint.
        inertia, dry, viscous: of the drives, one number for each joint.
        gravity: in the base frame [m/s^2].
    """

    axes: str = "yxy"
    inertia: tuple[float, ...] = (0.7, 0.2, 0.05)
    dry: tuple[float, ...] = (2.0, 0.8, 0.2)
    viscous: tuple[float, ...] = (1.5, 0.6, 0.1)
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(f"j{i}" for i in range(len(self.axes)))

    @property
    def urdf(self) -> str:
        """Links that become lighter."""
        parts, parent = ['<robot name="arm">{options}<link name="base"/>'], "base"
        for i, (name, letter) in enumerate(zip(self.joints, self.axes, strict=True)):
            mass, axis = 3.0 * 0.6**i, {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}[letter.lower()]
            kind = "prismatic" if letter.isupper() else "revolute"
            sizes = {key: f"{mass * part:.6f}" for key, part in (("ixx", 0.014), ("iyy", 0.015), ("izz", 0.004))}
            place = -0.36 if i else 0.0
            parts.append(LINK.format(name=name, kind=kind, parent=parent, place=place, axis=axis, mass=mass, **sizes))
            parent = f"of_{name}"
        return "\n".join(parts) + "</robot>"

    def truth(self, joint: int) -> dict[str, float]:
        """What a regression has to find."""
        return {"gain": 1.0, "inertia": self.inertia[joint], "dry": self.dry[joint], "viscous": self.viscous[joint]}


def moved(
    arm: Arm,
    *,
    seconds: float = 8.0,
    encoder_rate: float = 100.0,
    command_rate: float = 100.0,
    noise: float = 1e-5,
    counts: int = 0,
    pause: float = 0.0,
    seed: int = 1,
    sticks: bool = False,
    push: tuple[float, float, int, float] | None = None,
    stop: tuple[int, float, float] | None = None,
    cable: float = 0.0,
    sharp: float = SHARP,
    most: tuple[float, ...] = (),
    drive: Drive | None = None,
) -> tuple[Stream, Stream]:
    """Positions and torques of a motion around a posture, stamps with a little jitter.

    Args:
        arm: what moves.
        seconds: how long.
        encoder_rate, command_rate: in Hz.
        noise: of the positions [rad].
        counts: of an encoder per turn; 0 for one that is only noisy.
        pause: share of the time in which the commands hold the joints at rest.
        seed: of motion, jitter and noise.
        sticks: whether dry friction truly holds a joint that stands; else it turns over within a few mrad/s.
        push: from and to [s], joint, torque [N m] of a hand.
        stop: joint, and from where to where it can move from its middle [rad].
        cable: stiffness of a cable that pulls each joint to its zero [N m/rad].
        most: torque that each drive gives at the most, whatever is commanded [N m]; empty for all that is asked.
        drive: what the drives make of commands, from the time [s], the commands, and the engine's model and data, which
            it may change.
        sharp: how sharply dry friction turns over that does not truly hold a joint [s/rad].
    """
    rng, n = np.random.default_rng(seed), len(arm.axes)
    text = arm.urdf.format(options='<mujoco><compiler balanceinertia="false"/></mujoco>')
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep, model.opt.gravity[:] = STEP, arm.gravity
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    model.dof_armature[:], model.dof_damping[:] = arm.inertia, arm.viscous
    model.jnt_stiffness[:] = cable
    dry = np.array(arm.dry)
    if sticks:  # stiff enough that nothing is seen to creep
        model.dof_frictionloss[:], dry = arm.dry, np.zeros(n)
        model.dof_solref[:], model.dof_solimp[:] = (0.002, 1.0), (0.9999, 0.9999, 0.001, 0.5, 2.0)
    middle, size = rng.uniform(-0.8, 0.8, n), np.where([a.isupper() for a in arm.axes], 0.06, 0.35)
    speeds, phases = rng.uniform(1.5, 9.0, (4, n)), rng.uniform(0.0, 6.0, (4, n))
    if stop is not None:
        model.jnt_limited[stop[0]], model.jnt_range[stop[0]] = True, middle[stop[0]] + np.array(stop[1:])
        model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    data = mujoco.MjData(model)
    data.qpos[:] = middle
    due = np.unique(np.rint(_stamps(rng, seconds, command_rate) / STEP).astype(int))
    sampled = _stamps(rng, seconds, encoder_rate)
    path, commands = np.zeros((int(seconds / STEP) + 1, n)), np.zeros((len(due), n))
    path[0], u, sent, heavy = middle, np.zeros(n), 0, np.array(arm.inertia) + 0.15
    for k in range(len(path) - 1):
        if sent < len(due) and k == due[sent]:
            t = k * STEP
            run = 1.0 if pause == 0.0 or (t % 2.0) / 2.0 > pause else 0.0
            target = middle + run * (size / 2.0 * (np.sin(speeds * t + phases) - np.sin(phases))).sum(axis=0)
            u = data.qfrc_bias + heavy * (150.0 * (target - data.qpos) - 12.0 * data.qvel)
            commands[sent], sent = u, sent + 1
        given = np.clip(u, -np.array(most), np.array(most)) if most else u
        given = given if drive is None else drive(k * STEP, given, model, data)
        data.qfrc_applied[:] = given - dry * np.tanh(sharp * data.qvel)
        if push is not None and push[0] <= k * STEP < push[1]:
            data.qfrc_applied[push[2]] += push[3]
        mujoco.mj_step(model, data)
        path[k + 1] = data.qpos
    positions = np.column_stack([np.interp(sampled, STEP * np.arange(len(path)), column) for column in path.T])
    if counts:
        positions = 2.0 * np.pi / counts * np.rint(positions * counts / (2.0 * np.pi))
    positions += noise * rng.standard_normal(positions.shape)
    # the engine turns a torque into speed at once and not over the step: it acts half a step early
    stamps = STEP * due - STEP / 2.0
    return Stream("encoder", sampled, positions, arm.joints, "rad"), Stream(
        "command", stamps, commands, arm.joints, "N m"
    )


def divided(command: Stream, constants: tuple[float, ...]) -> Stream:
    """The command in a unit that makes so many N m."""
    return replace(command, values=command.values / np.array(constants))


def written(arm: Arm, folder: Path) -> Path:
    """The URDF as a file."""
    (folder / "arm.urdf").write_text(arm.urdf.format(options=""), encoding="utf-8")
    return folder / "arm.urdf"


def robot_file(arm: Arm, folder: Path) -> Path:
    """A robot file of rigid joints beside its URDF; its start values are not the arm's."""
    written(arm, folder)
    joints = ", ".join(arm.joints)
    text = YAML.replace("JOINTS", joints).replace("NOISE", ", ".join(["0.3"] * len(arm.joints)))
    text = text.replace("EFFECTS", ", ".join(f'"motor_viscous@{joint}"' for joint in arm.joints))
    text += "".join(VALUES.replace("jN", joint) for joint in arm.joints)
    (folder / "arm.yaml").write_text(text, encoding="utf-8")
    return folder / "arm.yaml"


def assert_right(arm: Arm, parameters: Iterable[ParameterEstimate], rel: float) -> None:
    """Every value of every drive is that of the arm."""
    table = {p.name: p.value for p in parameters}
    truth = {"inertia": arm.inertia, "coulomb_torque": arm.dry, "motor_viscous.coefficient": arm.viscous}
    for law, values in truth.items():
        for joint, value in zip(arm.joints, values, strict=True):
            assert table[f"{joint}.{law}"] == pytest.approx(value, rel=rel), (joint, law)


def _stamps(rng: np.random.Generator, seconds: float, rate: float) -> np.ndarray:
    stamps = np.arange(0.0, seconds - 2.0 / rate, 1.0 / rate)
    return stamps + rng.uniform(0.0, 0.05 / rate, len(stamps))
