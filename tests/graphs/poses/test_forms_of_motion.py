# SPDX-License-Identifier: BSD-3-Clause
"""Gaps and masses in the form that motion has them, read by poses and by responses: one number for all kinds."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from three_axes import geometry_in_doubt, three_axes

from jointscope.graphs.poses.sagging_arm import SaggingArm
from jointscope.robots.effects.link_mass import change
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.arm_chain import ArmChain
from jointscope.robots.geometry.arm_effects import hypotheses
from jointscope.robots.geometry.flexible_arm import FlexibleArm
from jointscope.robots.model.structured_tree import StructuredTree

GAP = "joint3.backlash.half_gap"
LINK = {"joint2.link_mass.mass": 1.5, "joint2.link_mass.x": 0.3, "joint2.link_mass.y": -0.2, "joint2.link_mass.z": 0.4}
Q = np.random.default_rng(3).uniform(-1.2, 1.2, (5, 6))


@pytest.fixture(scope="module")
def robot():
    return load_robot("tx90l")


def heavier(robot):
    """pinocchio's model of the arm whose second link has ten other numbers, by the law of the catalogue."""
    model = robot.tree.model.copy()
    j = model.getJointId("joint2")
    body = np.array(model.inertias[j].toDynamicParameters())
    more = sum(LINK[f"joint2.link_mass.{name}"] * each for name, each in change(body).items())
    model.inertias[j] = pin.Inertia.FromDynamicParameters(body + more)
    return model


def test_the_gap_of_motion_is_that_of_the_paper_with_the_other_sign(robot):
    arm, values = SaggingArm(robot), {**robot.values, "joint3.backlash": 0.0}
    still = np.zeros_like(Q)
    own = arm.at(Q, still, {**values, GAP: 3e-4})
    papers = arm.at(Q, still, {**values, "joint3.backlash": -3e-4})
    np.testing.assert_allclose(own.target, papers.target, atol=1e-15)
    assert np.max(np.abs(own.target - arm.at(Q, still, values).target)) > 1e-5
    np.testing.assert_allclose(own.by_value[GAP], -papers.by_value["joint3.backlash"], atol=1e-12)


@pytest.mark.parametrize("name", [GAP, *LINK])
def test_slopes_of_poses_by_forms_of_motion_are_differences(robot, name):
    arm, still, size = SaggingArm(robot), np.zeros_like(Q), 1e-6 if name == GAP else 1e-3
    values = {**robot.values, GAP: 3e-4, **LINK}
    ends = [arm.at(Q, still, {**values, name: values[name] + sign * size}).target for sign in (1.0, -1.0)]
    slope = (ends[0] - ends[1]) / (2.0 * size)
    assert np.max(np.abs(slope)) > 1e-7
    np.testing.assert_allclose(arm.at(Q, still, values).by_value[name], slope, rtol=1e-5, atol=1e-12)


def test_gravity_of_a_heavier_link_is_that_of_the_law_of_the_catalogue(robot):
    model = heavier(robot)
    expected = [-pin.computeGeneralizedGravity(model, model.createData(), q) for q in Q]
    chain = ArmChain(robot.tree, "reflector", np.zeros(3))
    np.testing.assert_allclose(chain.at(Q, LINK).gravity, expected, atol=1e-9)


def test_a_shaken_arm_has_the_inertia_of_the_law_of_the_catalogue(robot):
    found = FlexibleArm(robot).linearised(Q[0], {**robot.values, **LINK}).mean
    tree = copy.copy(robot.tree)
    tree.model = heavier(robot)
    expected = FlexibleArm(replace(robot, tree=tree)).linearised(Q[0], robot.values).mean
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


def test_a_gap_that_the_model_has_in_the_form_of_motion_is_not_looked_for_again(robot):
    known = {n: p for n, p in robot.parameters.items() if n != "joint3.backlash"}
    labels = {h.label for h in hypotheses(robot.joints, known, True)}
    assert "backlash@joint3" in labels
    assert "backlash@joint3" not in {h.label for h in hypotheses(robot.joints, {*known, GAP}, True)}


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """An arm that moves, is shaken and is seen at rest."""
    folder = tmp_path_factory.mktemp("three")
    three_axes(folder)
    return geometry_in_doubt(folder)


def test_a_load_at_the_target_is_one_mass_for_motion_poses_and_responses(three):
    loaded = add_effect(three, "payload@robot", {"mass": 2.0})
    q = Q[:, :3]
    model, values = StructuredTree(loaded).bodies(loaded.values).model, {**three.values, "robot.payload.mass": 2.0}
    assert model.inertias[3].mass == pytest.approx(three.tree.model.inertias[3].mass + 2.0)
    chain = ArmChain(three.tree, three.poses.link, three.poses.at)
    expected = [-pin.computeGeneralizedGravity(model, model.createData(), each) for each in q]
    np.testing.assert_allclose(chain.at(q, values).gravity, expected, atol=1e-9)
    arm = FlexibleArm(three)
    tree = copy.copy(three.tree)
    tree.model = model
    other = FlexibleArm(replace(three, tree=tree)).linearised(q[0], three.values).mean[0]
    np.testing.assert_allclose(arm.linearised(q[0], values).mean[0], other, rtol=1e-6, atol=1e-6)


def test_torques_by_a_load_at_the_target_are_differences(three):
    loaded = add_effect(three, "payload@robot", {"mass": 2.0})
    tree, rng = StructuredTree(loaded), np.random.default_rng(5)
    q, v, a = rng.standard_normal((3, 6, 3))
    values, name = dict(loaded.values), "robot.payload.mass"
    bodies = tree.bodies(values)
    tau = bodies.torque(q, v, a)
    by = tree.by_parameter(q, v, tau, a, np.linalg.inv(bodies.mass_matrix(q)), values)[name]
    ends = [tree.bodies({**values, name: 2.0 + step}).acceleration(q, v, tau) for step in (1e-4, -1e-4)]
    np.testing.assert_allclose(by, (ends[0] - ends[1]) / 2e-4, rtol=1e-5, atol=1e-7)


def test_a_robot_without_poses_has_no_load_at_a_target(three):
    payload = catalogue()["payload"]
    assert payload.owners_of(three) == ("joint3", "robot")
    assert payload.owners_of(replace(three, poses=None)) == ("joint3",)
