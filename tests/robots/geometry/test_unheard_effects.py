# SPDX-License-Identifier: BSD-3-Clause
"""What acts on an arm at rest or in a vibration and is no part of its model there is told, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from lever_of_all_kinds import Lever

from jointscope.graphs.poses.sagging_arm import SaggingArm
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.geometry.arm_effects import FREQUENCY, POSES
from jointscope.robots.geometry.unheard_effects import unheard_effects

BENDS = "hysteresis spring_curve spring_limit spring_pieces_1 spring_pieces_2 spring_pieces_4 spring_slack"
BODIES = "gravity_direction gravity_imbalance parallel_spring axis_misalignment bearing_flexibility"
READS = "encoder_harmonics encoder_hysteresis encoder_scale"
BOTH = {*BENDS.split(), *BODIES.split(), *READS.split()}
AT_REST = BOTH | {"encoder_offset"}
SHAKEN = BOTH | {
    *"cogging friction_by_direction quadratic_damping weight_dependent_friction backlash inertia_error".split(),
    *"link_coulomb link_viscous encoder_delay encoder_filter payload".split(),
}
OF_OTHER_ROBOTS = {  # of several joints or with gyros; or a lever has it by itself
    *"coriolis kinematic_coupling gyro_bias_drift gyro_delay gyro_scale".split(),
    *"motor_viscous joint_elasticity integration_error".split(),
}
HEARD_AT_REST = {"backlash", "spring_cubic", "link_mass", "encoder_eccentricity"}


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    robot = Lever(tmp_path_factory.mktemp("lever")).robot
    return robot.with_values({"swing.stiffness": 500.0})


def with_size(robot, label):
    """An effect at the sizes of its card."""
    effect, _, owner = label.partition("@")
    sizes = {f"{owner}.{effect}.{name}": size for name, size in catalogue()[effect].example.items()}
    found = add_effect(robot, label)
    return found.with_values({name: size for name, size in sizes.items() if name in found.parameters})


def target(robot):
    q = np.linspace(-1.0, 1.0, 5)[:, None]
    values = {name: p.value for name, p in robot.parameters.items()}
    return SaggingArm(robot).at(q, np.zeros_like(q), values).target


@pytest.mark.parametrize("effect", sorted({*catalogue()} - OF_OTHER_ROBOTS))
def test_effects_that_act_and_have_no_part_are_told(arm, effect):
    owner = next(owner for owner in ("swing", "robot") if not catalogue()[effect].may_act_on(arm, owner))
    label = f"{effect}@{owner}"
    assert unheard_effects(arm, POSES) == unheard_effects(arm, FREQUENCY) == ()
    robot = with_size(arm, label)
    assert unheard_effects(robot, POSES) == ((label,) if effect in AT_REST else ())
    assert unheard_effects(robot, FREQUENCY) == ((label,) if effect in SHAKEN else ())
    moved = np.abs(target(robot) - target(arm)).max()
    assert (moved > 1e-9) == (effect in HEARD_AT_REST)


def test_an_effect_at_its_null_value_is_none(arm):
    robot = with_size(arm, "spring_curve@swing")
    none = dict.fromkeys((n for n in robot.parameters if ".spring_curve." in n), 0.0)
    assert unheard_effects(robot, POSES) and unheard_effects(robot.with_values(none), POSES) == ()
