# SPDX-License-Identifier: BSD-3-Clause
"""The robots of the benchmark of arms, as their makers ship them, and how each was recorded.

Only data files of four packages are read; none of their code runs.
"""

from __future__ import annotations

import importlib.metadata
from dataclasses import dataclass, field, replace
from pathlib import Path

EXAMPLE, ICUB, AIRO, DEXMATE = "example-robot-data", "icub-models", "airo-models", "dexmate-urdf"
QUICK = ("ur5", "panda", "go1", "tiago", "icub_left_arm", "allegro_thumb", "robotiq_2f_85", "so100")


@dataclass(frozen=True)
class ArmCase:
    """A robot and a recording of it.

    Attributes:
        name: of the case.
        package, path: where the URDF is; the path is the end of a file's.
        last, count: the last joint that moves, and how many up the chain from it, mimics not counted.
        unit: of the command: Nm, A or duty.
        rate: of commands and joint states [Hz].
        order: of the names in /joint_states: alphabetical, shuffled, some (nothing beside the chain), extra (with names
            of no joint), no_mimics.
        command: who is named: all (others zero), holding (others with the torque that holds them), group, array
            (numbers without names), measured (effort in /joint_states, nothing else).
        counts: of an encoder per turn, or per metre of a slide; 0 for fine ones with noise.
        held: whether joints that do not move stand at a posture or at zero.
        skip: joints of the chain that are held all the same.
        sticks: whether dry friction truly holds a joint that stands.
    """

    name: str
    package: str
    path: str
    last: str
    count: int
    unit: str = "Nm"
    rate: float = 100.0
    order: str = "alphabetical"
    command: str = "all"
    counts: int = 0
    held: str = "posture"
    skip: tuple[str, ...] = field(default=())
    sticks: bool = False

    @property
    def variant(self) -> str:
        """How it was recorded, in words."""
        parts = [self.unit, f"{self.rate:g} Hz", self.order, f"command: {self.command}"]
        parts += [f"{self.counts} counts"] * bool(self.counts) + ["others at zero"] * (self.held == "zero")
        parts += ["sticks"] * self.sticks
        return ", ".join(parts)


def _of(package: str, name: str, path: str, last: str, count: int, **how: object) -> ArmCase:
    return ArmCase(name, package, path, last, count, **how)  # type: ignore[arg-type]


def cases() -> list[ArmCase]:
    """All of them."""
    return [*_arms(), *_legs(), *_hands(), *_mobile(), *_sticking()]


def _arms() -> list[ArmCase]:
    e, ur = EXAMPLE, "ur_description/urdf/"
    return [
        _of(e, "ur5", ur + "ur5_robot.urdf", "wrist_3_joint", 6, rate=125.0),
        _of(e, "ur3_gripper", ur + "ur3_gripper.urdf", "wrist_1_joint", 4, unit="A", rate=125.0, command="group"),
        _of(e, "ur10", ur + "ur10_robot.urdf", "elbow_joint", 3, rate=250.0, command="holding"),
        _of(AIRO, "ur3e", "ur3e/ur3e.urdf", "wrist_3_joint", 6, rate=100.0, order="shuffled"),
        _of(AIRO, "ur5e", "ur5e/ur5e.urdf", "elbow_joint", 2, unit="A", rate=500.0, command="measured"),
        _of(e, "panda", "panda_description/urdf/panda.urdf", "panda_joint7", 7, command="group"),
        _of(e, "panda_hand", "panda_description/urdf/panda_collision.urdf", "panda_finger_joint1", 3, held="zero"),
        _of(e, "xarm7", "xarm_description/urdf/xarm7.urdf", "joint5", 4, unit="A", skip=("joint3",)),
        _of(e, "kinova", "kinova_description/robots/kinova.urdf", "j2s6s200_joint_6", 6, order="extra"),
        _of(e, "so100", "so_arm_description/urdf/so100.urdf", "wrist_flex", 3, unit="duty", rate=50.0, counts=65536),
        _of(e, "so101", "so_arm_description/urdf/so101.urdf", "gripper", 6, rate=100.0, counts=4096),
        _of(e, "z1", "z1_description/urdf/z1.urdf", "joint6", 5, rate=200.0, command="array"),
        _of(e, "two_dofs", "asr_twodof_description/urdf/TwoDofs.urdf", "J2", 2, unit="duty", rate=200.0),
        _of(e, "pendulum", "urdf/double_pendulum_continuous.urdf", "joint2", 2, unit="A", rate=50.0),
        _of(e, "hextilt_arm", "urdf/hextilt_flying_arm_5.urdf", "flying_arm_5__j_link_4_link_5", 5, order="shuffled"),
        _of(e, "borinot_arm", "urdf/borinot_flying_arm_2.urdf", "flying_arm_2__j_link1_link2", 2, unit="A"),
        _of(e, "baxter_left", "baxter_description/urdf/baxter.urdf", "left_w2", 7, command="group", order="extra"),
        _of(e, "talos_arm", "talos_data/robots/talos_left_arm.urdf", "arm_left_5_joint", 4, command="holding"),
    ]


def _legs() -> list[ArmCase]:
    e = EXAMPLE
    return [
        _of(e, "go1", "go1_description/urdf/go1.urdf", "FL_calf_joint", 3, rate=200.0),
        _of(e, "go2", "go2_description/urdf/go2.urdf", "RR_calf_joint", 3, unit="A", rate=500.0, command="group"),
        _of(e, "a1", "a1_description/urdf/a1.urdf", "FR_calf_joint", 2, counts=16384, order="shuffled"),
        _of(e, "anymal_c", "anymal_c_simple_description/urdf/anymal.urdf", "LF_KFE", 3, command="array"),
        _of(e, "anymal_kinova", "robots/anymal-kinova.urdf", "j2s6s200_joint_4", 3, unit="A", order="some"),
        _of(e, "hyq", "robots/hyq_no_sensors.urdf", "lf_kfe_joint", 2, rate=250.0, command="holding"),
        _of(e, "solo12", "robots/solo12.urdf", "HR_KFE", 3, unit="A", rate=1000.0, command="measured"),
        _of(e, "bolt", "robots/bolt.urdf", "FL_KFE", 3, rate=100.0, held="zero"),
        _of(e, "laikago", "laikago_description/urdf/laikago.urdf", "RL_calf_joint", 3, order="shuffled"),
        _of(e, "finger_edu", "robots/finger_edu.urdf", "finger_middle_to_lower_joint", 3, unit="duty", rate=1000.0),
        _of(e, "talos_leg", "robots/talos_reduced.urdf", "leg_left_4_joint", 4, rate=50.0, held="zero"),
        _of(e, "romeo_leg", "urdf/romeo_small.urdf", "RKneePitch", 3, unit="A", command="group"),
        _of(e, "alexander_leg", "alexander_v1.lowerBodyOnly.urdf", "LEFT_KNEE_Y", 4, rate=200.0),
        _of(e, "g1_arm", "urdf/g1_29dof_rev_1_0.urdf", "left_elbow_joint", 4, command="group"),
        _of(ICUB, "icub_right_leg", "iCubGenova04/model.urdf", "r_knee", 3, unit="A"),
    ]


def _hands() -> list[ArmCase]:
    e, d = EXAMPLE, DEXMATE
    return [
        _of(e, "allegro_thumb", "urdf/allegro_right_hand.urdf", "joint_15.0", 4, rate=200.0),
        _of(e, "allegro_finger", "urdf/allegro_left_hand.urdf", "joint_3.0", 3, order="some", command="group"),
        _of(AIRO, "robotiq_2f_85", "urdf/robotiq_2f_85.urdf", "finger_joint", 1, rate=100.0, order="no_mimics"),
        _of(AIRO, "schunk_egk40", "schunk_egk40/urdf/schunk_egk40.urdf", "left_finger_mount_joint", 1, rate=200.0),
        _of(d, "dexd_gripper", "dexd_gripper/dexd_gripper.urdf", "gripper_j1", 1, order="no_mimics"),
        _of(d, "f5d6_finger", "f5d6_hand/f5d6_left.urdf", "L_ff_j1", 1, rate=200.0, command="group"),
        _of(d, "f5d6_thumb", "f5d6_hand/f5d6_right.urdf", "R_th_j1", 2, rate=250.0),
        _of(e, "alex_finger", "urdf/alex_psyonic_hands.urdf", "Left_index_q1", 2, rate=200.0, command="group"),
        _of(ICUB, "icub_hand", "left_hand_mk3/model.urdf", "l_hand_thumb_distal_joint", 4),
        _of(ICUB, "icub_wrist", "left_wrist_mk2/model.urdf", "l_wrist_yaw", 3, unit="A", rate=200.0),
    ]


def _mobile() -> list[ArmCase]:
    e, d = EXAMPLE, DEXMATE
    return [
        _of(e, "tiago", "robots/tiago.urdf", "arm_7_joint", 7, rate=100.0),
        _of(e, "tiago_dual", "robots/tiago_dual.urdf", "arm_left_4_joint", 4, unit="A", rate=50.0, command="group"),
        _of(e, "tiago_lift", "robots/tiago_no_hand.urdf", "arm_4_joint", 5, rate=100.0, command="group"),
        _of(e, "pr2_arm", "pr2_description/urdf/pr2.urdf", "r_wrist_roll_joint", 5, rate=100.0, order="no_mimics"),
        _of(e, "b1_z1", "b1_description/urdf/b1-z1.urdf", "joint3", 3, unit="A", order="extra"),
        _of(e, "centauro", "centauro_description/urdf/centauro.urdf", "j_arm1_4", 4, rate=100.0, order="shuffled"),
        _of(ICUB, "icub_left_arm", "iCubGazeboV2_7/model.urdf", "l_wrist_prosup", 5, rate=100.0),
        _of(e, "icub_torso", "robots/icub.urdf", "torso_yaw", 3, rate=100.0, command="holding"),
        _of(d, "vega_arm", "vega_1/vega_1_gripper.urdf", "L_arm_j7", 7, rate=100.0, command="group"),
        _of(d, "vega_lift", "vega_1u/vega_1u.urdf", "R_arm_j3", 4, unit="A", skip=("torso_flip",)),
        _of(e, "humanoid", "urdf/simple_humanoid.urdf", "LARM_ELBOW", 4, rate=200.0, order="some"),
    ]


def _sticking() -> list[ArmCase]:
    """Some of them once more, each twice: another name is another motion and another truth."""
    again = ("ur10", "go2", "pr2_arm", "icub_left_arm", "z1", "tiago_lift", "panda", "allegro_finger")
    table = {case.name: case for case in [*_arms(), *_legs(), *_hands(), *_mobile()]}
    return [replace(table[name], name=f"{name}_sticks{i}", sticks=True) for name in again for i in (1, 2)]


def urdf_file(case: ArmCase) -> Path:
    """Where the package keeps it."""
    files = importlib.metadata.distribution(case.package).files or []
    found = [file for file in files if str(file).endswith("/" + case.path)]
    if len(found) != 1:
        raise FileNotFoundError(f"{case.name}: {len(found)} files of {case.package} end in {case.path}; expected one")
    return Path(str(found[0].locate())).resolve()
