# SPDX-License-Identifier: BSD-3-Clause
"""Everything that is hidden in a simulated recording: what, where, how large, and under which circumstances.

Every effect of the catalogue in two sizes and, where it has a choice, at two owners; recordings without any; pairs;
effects outside the catalogue; short, disturbed and jittery recordings; plain mistakes; settings of arms of makers; axes
with a spring that nobody declared; axes that lack one large thing among many small ones. Seeds are fixed by the place
in the table, so each recording is another robot on another occasion. Only append to a list: what is inserted moves the
seeds of all that follow.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from hidden_axes import HiddenAxis, hidden_axes
from setting_arms import SettingCase, setting_cases
from spring_axes import SpringAxis, spring_axes

EFFECTS = (
    ("motor_viscous@joint1:coefficient=2", "motor_viscous@joint3:coefficient=5"),
    ("motor_stribeck@joint2:torque=0.8,velocity=0.1", "motor_stribeck@joint3:torque=2,velocity=0.15"),
    ("load_dependent_friction@joint2:coefficient=0.12", "load_dependent_friction@joint1:coefficient=0.3"),
    ("asymmetric_friction@joint2:torque=0.3", "asymmetric_friction@joint3:torque=0.8"),
    ("cogging@joint1:cos=0.3,sin=0.4,order=42.092", "cogging@joint2:cos=-0.6,sin=0.5,order=42.092"),
    ("torque_offset@joint3:torque=0.5", "torque_offset@joint1:torque=-0.8"),
    ("motor_lag@robot:time_constant=0.003", "motor_lag@joint2:time_constant=0.006"),
    ("command_delay@robot:delay=0.002", "command_delay@joint3:delay=0.005"),
    ("pwm_deadband@joint1:width=0.01", "pwm_deadband@joint2:width=0.03"),
    ("spring_cubic@joint1:stiffness=10000", "spring_cubic@joint2:stiffness=20000"),
    ("backlash@joint3:half_gap=0.006", "backlash@joint1:half_gap=0.012"),
    ("hysteresis@joint2:torque=1.5,deflection=0.01", "hysteresis@joint1:torque=3,deflection=0.01"),
    ("kinematic_coupling@joint2:from_joint1=0.02", "kinematic_coupling@joint3:from_joint2=0.05"),
    ("link_viscous@joint2:coefficient=0.5", "link_viscous@joint1:coefficient=2"),
    ("link_coulomb@joint3:torque=0.4", "link_coulomb@joint2:torque=1"),
    ("gravity_imbalance@joint2:cos=0.6,sin=1.2", "gravity_imbalance@joint3:cos=2,sin=-2"),
    ("payload@joint3:inertia=0.015", "payload@joint3:inertia=0.05"),
    ("inertia_error@joint1:izz=0.05", "inertia_error@joint2:ixx=0.05,iyy=0.06"),
    (
        "bearing_flexibility@joint1:compliance_x=0.0002,compliance_y=0.00025",
        "bearing_flexibility@joint1:compliance_x=0.0006,compliance_y=0.0004",
    ),
    (
        "encoder_eccentricity@joint1:cos=0.0002,sin=0.0002,order=42.092",
        "encoder_eccentricity@joint3:cos=0.003,sin=-0.002,order=1",
    ),
    ("encoder_delay@robot:delay=0.001", "encoder_delay@joint2:delay=0.003"),
    ("gyro_delay@imu2:delay=0.002", "gyro_delay@imu1:delay=0.005"),
    ("gyro_scale@imu2:x=0.01,y=-0.01,z=0.01", "gyro_scale@imu1:x=0,y=0.03,z=0"),
    ("gyro_bias_drift@imu1:x=0.0006,y=0.0006,z=-0.0006", "gyro_bias_drift@imu2:x=0.0015,y=-0.0015,z=0.0015"),
    ("clock_offset@imu2:offset=0.003", "clock_offset@robot:offset=-0.003"),
    ("clock_drift@imu2:drift=0.001", "clock_drift@robot:drift=0.0004"),
)
# Later additions; they come after everything else of their kind and leave the seeds of the others alone.
MORE = (
    "bearing_flexibility@joint1:compliance_x=0.0004,compliance_y=0.0003,product_xz=-0.02,product_yz=0.01",
    "encoder_scale@joint2:scale=0.02",
    "encoder_scale@joint3:scale=-0.05",
    "encoder_hysteresis@joint2:half_play=0.0003",
    "encoder_hysteresis@joint3:half_play=0.0007",
)
# What the recording contains anyway and the model leaves out: changed lines of the robot file.
LEFT_OUT: Mapping[str, tuple[str, str]] = {
    "coriolis@robot": ("coriolis: true", "coriolis: false"),
    "joint_elasticity@joint1": ("integrator: simpson", "rigid_joints: [joint1]\n  integrator: simpson"),
    "joint_elasticity@joint3": ("integrator: simpson", "rigid_joints: [joint3]\n  integrator: simpson"),
    "integration_error@robot": ("integrator: simpson", "integrator: euler"),
}
PAIRS = (
    ("bearing_flexibility@joint1", "load_dependent_friction@joint2:coefficient=0.25"),
    ("backlash@joint3:half_gap=0.01", "cogging@joint1:cos=0.5,sin=0.4,order=42.092"),
    ("load_dependent_friction@joint1:coefficient=0.2", "torque_offset@joint3:torque=0.8"),
    ("gravity_imbalance@joint2:cos=1,sin=1.5", "gyro_scale@imu2:x=0.015,y=-0.015,z=0.01"),
    ("hysteresis@joint2:torque=2,deflection=0.01", "motor_stribeck@joint3:torque=1.5,velocity=0.1"),
    ("command_delay@robot:delay=0.003", "payload@joint3:inertia=0.04"),
    ("spring_cubic@joint2:stiffness=20000", "asymmetric_friction@joint3:torque=0.6"),
    ("kinematic_coupling@joint2:from_joint1=0.03", "link_coulomb@joint3:torque=0.8"),
    ("backlash@joint1:half_gap=0.01", "backlash@joint3:half_gap=0.01"),
    ("gyro_delay@imu2:delay=0.004", "cogging@joint2:cos=-0.6,sin=0.5,order=42.092"),
)
OUTSIDE = (
    "position_dependent_friction@joint2",
    "position_dependent_friction@joint1:torque=1.5,centre=-0.1,width=0.3",
    "supply_sag@robot",
    "swinging_tool@joint3",
    "warming_friction@joint1",
    "warming_friction@joint3:torque=3,time_constant=8",
    "joint_stop@joint2",
    "joint_stop@joint3:angle=0.35,stiffness=80",
)
IN_HARD_RECORDINGS = (
    "bearing_flexibility@joint1",
    "load_dependent_friction@joint2:coefficient=0.25",
    "backlash@joint3:half_gap=0.012",
    "",
)
HARD: Mapping[str, Mapping[str, Any]] = {
    "short": {"seconds": 6.0},
    "disturbed": {"disturbance": {"link": 0.3, "motor": 0.3, "correlation_time": 0.02}},
    "jittery": {"jitter": 2e-4, "drop": 0.02},
}
FAR_START = "start values 3 times off"
MISTAKES = (
    ("swapped_axes@imu2", ""),
    ("swapped_axes@imu1:swap=23", ""),
    ("wrong_gear@joint1", ""),
    ("wrong_gear@robot:factor=1.05", ""),
    ("wrong_gear@joint2", ""),
    ("wrong_gear@joint3", ""),
    ("inertia_error@joint1:izz=0.01", ""),
    ("", FAR_START),
)

CLEAN = 20
AXES = 3  # of everything that is hidden in single axes
TRAIN, TEST = 20.0, 8.0  # [s]
DOGGYS = ("effect", "clean", "pair", "outside", "hard", "mistake")
KINDS = (*DOGGYS, "setting", "spring", "axis")
FIRST_SEED = dict(zip(KINDS, range(2000, 11000, 1000), strict=True))


@dataclass(frozen=True)
class Case:
    """One pair of recordings and what is hidden in them.

    Attributes:
        kind: one of KINDS.
        hidden: texts ID@OWNER[:param=value,...] for the simulator.
        left_out: ID@OWNER that the model leaves out, see LEFT_OUT.
        seed: of the simulation.
        circumstance: a key of HARD, FAR_START, or "".
    """

    kind: str
    hidden: tuple[str, ...]
    left_out: tuple[str, ...]
    seed: int
    circumstance: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Unique, readable."""
        parts = [*self.hidden, *self.left_out] or ["nothing"]
        return " + ".join(parts) + (f", {self.circumstance}" if self.circumstance else "") + f" (seed {self.seed})"

    @property
    def truth(self) -> tuple[str, ...]:
        """ID@OWNER of everything that the model lacks."""
        return (*(text.split(":")[0] for text in self.hidden), *self.left_out)


AnyCase: TypeAlias = Case | SettingCase | SpringAxis | HiddenAxis


def cases(shift: int = 0) -> list[AnyCase]:
    """The whole table; `shift` is added to all seeds."""
    first = {kind: seed + shift for kind, seed in FIRST_SEED.items()}
    hidden: dict[str, list[tuple[tuple[str, ...], tuple[str, ...], str]]] = {
        "effect": [((text,), (), "") for sizes in EFFECTS for text in sizes]
        + [((), (lo,), "") for lo in LEFT_OUT]
        + [((text,), (), "") for text in MORE],
        "clean": [((), (), "")] * CLEAN,
        "pair": [(pair, (), "") for pair in PAIRS],
        "outside": [((text,), (), "") for text in OUTSIDE],
        "hard": [((text,) if text else (), (), how) for how in HARD for text in IN_HARD_RECORDINGS],
        "mistake": [((text,) if text else (), (), how) for text, how in MISTAKES],
    }
    doggys = [
        Case(kind, texts, left_out, first[kind] + i, how, HARD.get(how, {}))
        for kind in DOGGYS
        for i, (texts, left_out, how) in enumerate(hidden[kind])
    ]
    axes = [axis for i in range(AXES) for axis in hidden_axes(first["axis"] + i)]
    return [*doggys, *setting_cases(first["setting"]), *spring_axes(first["spring"]), *axes]


def tenth(every: list[AnyCase]) -> list[AnyCase]:
    """About one in ten of every kind, spread over the table."""
    found: list[AnyCase] = []
    for kind in KINDS:
        of_kind = [case for case in every if case.kind == kind]
        count = -(-len(of_kind) // 10)
        found += [of_kind[i * len(of_kind) // count] for i in range(count)]
    return found
