# SPDX-License-Identifier: BSD-3-Clause
"""Every effect of the catalogue has a whole card and parameters that can be, and is found by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.robots.effect_kinds.groups import GROUPS, group_of
from jointscope.robots.errors import EffectError
from jointscope.robots.files.effect_catalogue import catalogue, find_effect, parse_effect
from jointscope.robots.files.effect_check import check_effect
from jointscope.robots.files.effect_editing import add_effect, remove_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.structured_tree import StructuredTree

IDS = """motor_viscous motor_stribeck load_dependent_friction asymmetric_friction cogging torque_offset motor_lag
command_delay pwm_deadband spring_cubic backlash hysteresis kinematic_coupling link_viscous link_coulomb
gravity_imbalance coriolis payload inertia_error joint_elasticity bearing_flexibility encoder_eccentricity encoder_scale
spring_curve weight_dependent_friction encoder_delay gyro_delay gyro_scale gyro_bias_drift clock_offset clock_drift
truncated_command parallel_spring integration_error torque_constant_error link_mass gravity_direction encoder_offset
friction_by_direction spring_slack encoder_harmonics spring_limit spring_pieces_1 spring_pieces_2 spring_pieces_4
encoder_filter command_limit axis_misalignment""".split()
UNITS = {
    *("kg", "kg m", "1", "s", "s^2", "s/s", "rad", "rad/s", "rad/s^2", "rad/rad", "V", "kg m2"),
    *("N m", "N m/rad", "N m/rad^2", "N m/rad^3", "N m s/rad", "N m s^2/rad^2", "rad/(N m)", "1/(N m)"),
}
DOGGY = load_robot("doggy")
EFFECTS = list(catalogue().values())


def of(effects):
    return pytest.mark.parametrize("effect", effects, ids=lambda effect: effect.id)


# the catalogue


def test_every_promised_id_is_there():
    assert set(IDS) <= set(catalogue())


def test_the_motor_side_comes_first_and_numerics_last():
    places = [GROUPS.index(group_of(effect)) for effect in EFFECTS]
    assert places == sorted(places)
    assert EFFECTS[-1].id == "integration_error"


@of(EFFECTS)
def test_a_card_leaves_nothing_out(effect):
    for field in ("title", "law", "explanation", "source", "typical", "excitation"):
        assert len(getattr(effect.card, field)) > 4, field
    assert effect.card.look_alikes
    for other, reason in effect.card.look_alikes.items():
        assert other in catalogue() and other != effect.id
        assert len(reason) > 10


@of(EFFECTS)
def test_look_alikes_see_each_other(effect):
    for other in effect.card.look_alikes:
        assert effect.id in catalogue()[other].card.look_alikes, f"{other} does not name {effect.id}"


@of([effect for effect in EFFECTS if effect.id != "kinematic_coupling"])
def test_parameters_have_units_signs_priors_and_an_example(effect):
    check_effect(effect, effect.id)
    assert {p.unit for p in effect.parameters} <= UNITS
    assert set(effect.example) == {p.name for p in effect.parameters}


@of(EFFECTS)
def test_the_parameters_at_an_owner_have_positive_starts_where_estimated_as_logarithms(effect):
    for robot in (load_robot("doggy"), load_robot("doggy_paper")):
        for owner in effect.owners_of(robot):
            for p in effect.parameters_of(robot, owner):
                assert np.isfinite(p.start) and p.prior_sigma > 0
                assert p.unit in UNITS
                assert p.start > 0 or not p.logarithmic
                assert all(value > 0 for value in p.grid) or not p.logarithmic


def test_what_is_no_size_vanishes_with_a_size():
    for effect in EFFECTS:
        shapes = [p for p in effect.parameters if p.is_shape]
        assert len(shapes) < len(effect.parameters) or not shapes, effect.id


# structure


def test_a_bearing_starts_from_the_joint_that_it_carries():
    start = {p.name: p.start for p in catalogue()["bearing_flexibility"].parameters_of(DOGGY, "joint1")}
    assert start["compliance_x"] == pytest.approx(1.0 / 4000.0)
    assert start["inertia_x"] == pytest.approx(2.0)


def test_a_bearing_brings_every_entry_of_the_inertia_that_a_rigid_one_hides():
    robot = add_effect(DOGGY, "bearing_flexibility@joint1")
    tree, still = StructuredTree(robot), np.zeros((1, robot.layout.n_link))
    values = {name: p.value for name, p in robot.parameters.items()}

    def mass_matrix(**moved):
        full = {f"joint1.bearing_flexibility.{name}": value for name, value in moved.items()}
        accelerations = [tree.acceleration(still, still, row[None], {**values, **full})[0] for row in np.eye(5)]
        return np.linalg.inv(np.array(accelerations))

    # at rest in the middle the hinges x, y and the joint are the axes of the body's own frame
    start = {name: values[f"joint1.bearing_flexibility.{name}"] for name in ("inertia_x", "inertia_y")}
    x, y, z = (robot.layout.links.index(name) for name in ("joint1.bearing_x", "joint1.bearing_y", "joint1"))
    for name, (i, k) in {
        "inertia_x": (x, x),
        "inertia_y": (y, y),
        "product_xy": (x, y),
        "product_xz": (x, z),
        "product_yz": (y, z),
    }.items():
        expected = np.zeros((5, 5))
        expected[i, k] = expected[k, i] = 0.03
        change = mass_matrix(**{name: start.get(name, 0.0) + 0.03}) - mass_matrix()
        np.testing.assert_allclose(change, expected, atol=1e-10)


def test_structures_that_the_model_has_already_are_refused_with_the_reason():
    with pytest.raises(EffectError) as err:
        parse_effect("coriolis@robot", DOGGY)
    assert str(err.value) == (
        "effect 'coriolis@robot': coriolis is part of the model already: the robot file says coriolis: true"
    )
    with pytest.raises(EffectError) as err:
        parse_effect("joint_elasticity@joint1", DOGGY)
    assert str(err.value) == (
        "effect 'joint_elasticity@joint1': joint_elasticity cannot act on joint1, which has a spring already; only a "
        "joint declared rigid can get one"
    )
    assert parse_effect("coriolis@robot", load_robot("doggy_paper"))[1] == "robot"
    rigid = replace(DOGGY, choices=replace(DOGGY.choices, rigid_joints=("joint1",)))
    effect, owner = parse_effect("joint_elasticity@joint1", rigid)
    assert all(p.start > 0 for p in effect.parameters_of(rigid, owner))


@pytest.mark.parametrize("effect", ["kinematic_coupling", "spring_cubic", "backlash"])
def test_a_rigid_joint_gets_nothing_that_acts_on_its_spring(effect):
    rigid = replace(DOGGY, choices=replace(DOGGY.choices, rigid_joints=("joint1",)))
    with pytest.raises(EffectError) as err:
        add_effect(rigid, f"{effect}@joint1")
    assert str(err.value) == (
        f"{effect}@joint1 cannot be added to doggy: joint1 is rigid and has no spring; add joint_elasticity@joint1 "
        "first"
    )


# names on the command line


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("cogging", "effect 'cogging': expected ID@OWNER, for example cogging@joint1"),
        ("@joint1", "effect '@joint1': expected ID@OWNER, for example cogging@joint1"),
        ("coging@joint1", "no effect 'coging'; did you mean 'cogging'?"),
        ("xyz@joint1", "no effect 'xyz'; `jointscope effects` lists all, --effects FILE.py adds your own"),
        ("gyro_scale@imu3", "effect 'gyro_scale@imu3': gyro_scale acts on imu1, imu2; did you mean 'imu2'?"),
        ("payload@robot", "effect 'payload@robot': payload acts on joint3"),
    ],
)
def test_a_wrong_name_is_answered_with_the_right_one(text, message):
    with pytest.raises(EffectError) as err:
        parse_effect(text, DOGGY)
    assert str(err.value) == message


def test_an_effect_and_its_owner_are_found():
    assert parse_effect("cogging@joint2", DOGGY) == (catalogue()["cogging"], "joint2")
    assert parse_effect("clock_offset@robot", DOGGY)[1] == "robot"


def test_another_name_of_an_effect_is_accepted_and_written_as_its_id():
    arm = load_robot("biorob")
    twisted = add_effect(arm, "link_twist@joint3")
    assert (
        "joint3.axis_misalignment.x" in twisted.parameters and "axis_misalignment@joint3" in twisted.document["effects"]
    )
    assert not remove_effect(twisted, "link_twist@joint3").has_effect("axis_misalignment", "joint3")
    assert find_effect("link_encoder_nonlinearity").id == "encoder_eccentricity"
    for effect in EFFECTS:
        assert not set(effect.aliases) & set(catalogue()), effect.id
