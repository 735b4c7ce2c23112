# SPDX-License-Identifier: BSD-3-Clause
"""Arms of makers with a setting wrong: a torque constant, a mass, the direction of gravity, the zero of an encoder.

The robot file has the links of the URDF and start values for rotors, dry and viscous friction; the simulator knows
better. Every joint feels a random torque with a memory of 3 % of the torque that moves it, and a ripple.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from arm_cases import EXAMPLE, ArmCase, urdf_file
from numpy.typing import NDArray

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.simulator import simulate

Array = NDArray[np.float64]
TRAIN, TEST = 12.0, 6.0  # [s]
EVERY = 4  # ticks of a millisecond in one of the recording: drives speak at 250 Hz
COLOURED, MEMORY, RIPPLE, ORDER = 0.03, 0.05, 0.01, 20.0  # of the moving drive; [s]; of it; periods per turn
POSES = 200  # random ones that tell how large torques are
START = 1.3  # times the truth, of every start value

ARMS = {
    "ur5": ("ur_description/urdf/ur5_robot.urdf", ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint")),
    "z1": ("z1_description/urdf/z1.urdf", ("joint1", "joint2", "joint3")),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", ("joint1", "joint2", "joint4")),
}
DEGREE = np.pi / 180.0
FAULTS = {  # what the simulator has and the file has not; the place of the joint among those of the arm
    "torque_constant_error": (1, {"share": -0.1}),
    "link_mass": (2, {"mass": 0.4}),  # of the link's own
    "gravity_direction": (None, {"x": 4.0 * DEGREE, "y": -3.0 * DEGREE}),
    "encoder_offset": (2, {"offset": 0.05}),
}


@dataclass(frozen=True)
class SettingCase:
    """An arm and what is wrong with its file; an empty fault for nothing."""

    arm: str
    fault: str
    seed: int
    kind = "setting"

    @property
    def name(self) -> str:
        """Unique, readable."""
        return f"{self.fault or 'nothing'} on {self.arm} (seed {self.seed})"

    @property
    def truth(self) -> tuple[str, ...]:
        """ID@OWNER of what is wrong."""
        if not self.fault:
            return ()
        place, joints = FAULTS[self.fault][0], ARMS[self.arm][1]
        return (f"{self.fault}@{'robot' if place is None else joints[place]}",)


def setting_cases(seed: int) -> list[SettingCase]:
    """Every fault on every arm, and every arm without."""
    pairs = [(arm, fault) for fault in (*FAULTS, "") for arm in ARMS]
    return [SettingCase(arm, fault, seed + i) for i, (arm, fault) in enumerate(pairs)]


def arm_model(case: SettingCase, folder: Path) -> tuple[Robot, dict[str, float], Array]:
    """The robot as its file has it, its true drives, and the torque that moves each joint, shape (n,) [N m]."""
    path, joints = ARMS[case.arm]
    urdf = urdf_file(ArmCase(case.arm, EXAMPLE, path, joints[-1], len(joints)))
    (folder / "arm.yaml").write_text(_text(case.arm, urdf, joints, dict.fromkeys(joints, (1.0, 1.0, 1.0))))
    robot, rng = load_robot(folder / "arm.yaml"), np.random.default_rng(case.seed)
    low, high = np.clip(robot.tree.limits.T, -np.pi, np.pi)
    q, still = rng.uniform(low, high, (POSES, robot.n)), np.zeros((POSES, robot.n))
    inertia = np.mean(np.diagonal(robot.tree.mass_matrix(q), axis1=1, axis2=2), axis=0)
    drive = np.sqrt(np.mean(robot.tree.torque(q, still, still) ** 2, axis=0) + (2.0 * inertia) ** 2)  # at 2 rad/s^2
    values = {
        joint: (0.5 * inertia[j], rng.uniform(0.04, 0.08) * drive[j], rng.uniform(0.04, 0.08) * drive[j])
        for j, joint in enumerate(joints)
    }
    starts = {joint: (START * a, START * b, START * c) for joint, (a, b, c) in values.items()}
    (folder / "arm.yaml").write_text(_text(case.arm, urdf, joints, starts))
    names = ("inertia", "coulomb_torque", "motor_viscous.coefficient")
    true = {f"{joint}.{name}": v for joint, own in values.items() for name, v in zip(names, own, strict=True)}
    return load_robot(folder / "arm.yaml"), true, drive


def record_arm(
    case: SettingCase, robot: Robot, true: dict[str, float], drive: Array, seconds: float, occasion: int
) -> Recording:
    """What the arm with its fault does on one of several occasions, at the rate of its drives."""
    seed = 10 * case.seed + occasion
    sizes = [f"{name.rpartition('.')[2]}={value}" for name, value in true_sizes(case, robot).items()]
    effects = [f"{label}:{','.join(sizes)}" for label in case.truth]
    for joint, torque in zip(robot.joints, drive, strict=True):
        effects.append(f"coloured_torque@{joint}:torque={COLOURED * torque},memory={MEMORY},seed={seed}")
        effects.append(f"cogging@{joint}:cos={RIPPLE * torque},sin=0,order={ORDER}")
        effects.append(f"motor_viscous@{joint}:coefficient={true[f'{joint}.motor_viscous.coefficient']}")
    parameters = {name: value for name, value in true.items() if "viscous" not in name}
    bare = replace(robot, effects=())
    made = simulate(bare, "moves", seconds, seed, parameters=parameters, effects=effects, friction="dry")
    return _thinned(made.recording)


def true_sizes(case: SettingCase, robot: Robot) -> dict[str, float]:
    """What is wrong, by full name; empty for nothing."""
    if not case.fault:
        return {}
    (label,), sizes = case.truth, dict(FAULTS[case.fault][1])
    owner = label.split("@")[1]
    if "mass" in sizes:
        sizes["mass"] *= float(robot.tree.model.inertias[robot.tree.model.getJointId(owner)].mass)
    return {f"{owner}.{case.fault}.{name}": value for name, value in sizes.items()}


def _thinned(recording: Recording) -> Recording:
    """Mean commands of a few ticks, and the encoders at their beginning."""
    command, found = recording.command, {}
    count = len(command) // EVERY
    mean = command.values[: count * EVERY].reshape(count, EVERY, -1).mean(axis=1)
    found["command"] = replace(command, times=command.times[: count * EVERY : EVERY], values=mean, received=None)
    for name, stream in recording.streams.items():
        if name != "command":
            found[name] = Stream(name, stream.times[::EVERY], stream.values[::EVERY], stream.channels, stream.unit)
    return replace(recording, streams=found)


def _text(arm: str, urdf: Path, joints: tuple[str, ...], values: dict[str, tuple[float, float, float]]) -> str:
    lines = []
    for joint, (inertia, coulomb, viscous) in values.items():
        lines += [f"  {joint}.inertia: {{value: {inertia}, unit: kg m2, prior_sigma: {2 * inertia}}}"]
        lines += [f"  {joint}.coulomb_torque: {{value: {coulomb}, unit: N m, prior_sigma: {2 * coulomb}}}"]
        lines += [f"  {joint}.motor_viscous.coefficient: {{value: {viscous}, unit: N m s/rad, prior: 0.0, "]
        lines[-1] += f"prior_sigma: {20 * viscous}, positive: false, 'null': 0.0}}"
    many = ", ".join(["0.3"] * len(joints))
    return f"""format: 1
name: {arm}
urdf: {urdf}
gravity: [0.0, 0.0, -9.81]
joints: [{", ".join(joints)}]
model: {{rigid_joints: [{", ".join(joints)}]}}
command: {{topic: /effort, type: sensor_msgs/msg/JointState, field: effort, unit: N m}}
sensors:
  encoder: {{kind: motor_encoder, topic: /joint_states, type: sensor_msgs/msg/JointState, field: position, unit: rad,
            sigma: 1.0e-6}}
effects: [{", ".join(f"motor_viscous@{joint}" for joint in joints)}]
parameters:
{chr(10).join(lines)}
noise: {{estimate: true, link_velocity: [{many}], motor_velocity: [{many}]}}
"""
