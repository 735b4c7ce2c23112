# SPDX-License-Identifier: BSD-3-Clause
"""A common factor on masses and torques leaves no residual; two other things tell it."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from arm_bags import ArmMotion, write_arm_bag, write_urdf
from fake_results import fake_calibration

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.calibration.calibration_result import ParameterEstimate
from jointscope.graphs.rests.seen_rests import SeenRests
from jointscope.graphs.scoring.lacking_effects import LackingEffect
from jointscope.graphs.scoring.wrong_masses import WrongMass
from jointscope.graphs.starts.second_opinion import regressed_values
from jointscope.robots.bodies.possible_masses import impossible_masses
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.files.effects_at_once import add_effects
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main
from jointscope.tools.verdicts.judgement import judge
from jointscope.tools.verdicts.missing_effects import missing_effects
from jointscope.tools.verdicts.plausible_torques import plausible_torques

JOINTS = ("shoulder", "elbow")
QUESTION = "Masses and torques that go together"


def times_factor(urdf: Path, out: Path, masses: float, moments: float) -> Path:
    def scaled(factor):
        return lambda m: f'{m[1]}="{float(m[2]) * factor:.12g}"'

    text = re.sub(r'(mass value)="([^"]+)"', scaled(masses), urdf.read_text())
    out.write_text(re.sub(r'\b(i[xyz]{2})="([^"]+)"', scaled(moments), text))
    return out


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    urdf = write_urdf(folder / "arm.urdf", {"shoulder": None, "elbow": "shoulder"})
    motion = ArmMotion(urdf, JOINTS, seconds=8.0)
    topics = {"/joint_states": motion.states(JOINTS), "/motor_command": motion.commands(JOINTS)}
    return urdf, write_arm_bag(folder / "arm.mcap", motion.times, topics)


def begun(arm, tmp_path, masses, moments=None, *options):
    """The robot file that `init` writes from a URDF with other masses."""
    urdf = times_factor(arm[0], tmp_path / "other.urdf", masses, masses if moments is None else moments)
    assert main(["init", str(urdf), str(arm[1]), "-o", str(tmp_path / "own.yaml"), *options]) == 0
    return load_robot(tmp_path / "own.yaml")


def asked(robot, constants=(), recordings=()):
    """The answer for a calibration in which all else is good."""
    result = dataclasses.replace(
        fake_calibration(0.2),
        robot=robot,
        start=robot,
        parameters=tuple(
            ParameterEstimate(f"{joint}.torque_constant", k, 1e-3 * k, "N m/A", k, k, 2 * k)
            for joint, k in zip(robot.joints, constants, strict=False)
        ),
        regressed=regressed_values(robot, recordings) if recordings else {},
    )
    return plausible_torques(result)


@pytest.mark.parametrize(("masses", "moments"), [(1000.0, 1000.0), (1000.0, 1.0)])
def test_masses_in_grams_cannot_exist(arm, tmp_path, masses, moments):
    level, text = asked(begun(arm, tmp_path, masses, moments), (1000.0, 1000.0))
    assert level == "bad"
    assert "link shoulder_link of other.urdf has 2000 kg" in text or "link elbow_link of other.urdf has 2000 kg" in text
    assert "constants 1.00, 1.00 instead of 1000, 1000" in text and re.search(r"jointscope init \S*/other.urdf ", text)


def test_masses_of_arms_that_exist_are_not_doubted(arm):
    assert impossible_masses(RigidTree(arm[0], JOINTS, np.array([0.0, 0.0, -9.81])).model) is None
    for name in ("doggy", "hebi_2r", "hebi_3r", "hebi_5r", "kr300", "xl330_pendulum"):
        assert impossible_masses(load_robot(name).tree.model) is None, name


def test_torques_that_are_said_must_move_the_masses_as_torques_do(arm, tmp_path):
    robot = begun(arm, tmp_path, 0.5, None, "--unit", "N m")
    level, text = asked(robot, (), [read_recording(arm[1], robot)])
    assert level == "bad" and "one moves as 0.5" in text and "masses times 2" in text
    right = begun(arm, tmp_path, 1.0)
    assert right.command.unit == "N m"
    recording = read_recording(arm[1], right)
    assert asked(right, (), [recording])[0] == "good"
    found = regressed_values(right, [recording])
    assert found["elbow.torque_constant"].value == pytest.approx(1.0, abs=0.02)


def test_no_drive_makes_a_thousand_newton_metres_per_ampere(arm, tmp_path):
    level, text = asked(begun(arm, tmp_path, 3.0), (900.0, 5.0))
    assert level == "bad" and "shoulder.torque_constant is 900 N m/A, more than any drive makes" in text


def test_the_verdict_asks_for_it(tmp_path):
    good = fake_calibration(0.2)
    assert next(c.level for c in judge(good).checks if c.name == QUESTION) == "good"
    robot = good.robot
    heavy = times_factor(robot.tree.urdf, tmp_path / "grams.urdf", 1e5, 1e5)
    tree = RigidTree(heavy, robot.joints, robot.tree.gravity)
    found = judge(dataclasses.replace(good, robot=dataclasses.replace(robot, tree=tree)))
    assert next(c.level for c in found.checks if c.name == QUESTION) == "bad" == found.level


@pytest.fixture(scope="module")
def three_joints(tmp_path_factory):
    """Calibrations with drives in A: with the right masses, and without 0.3 kg of the last link."""
    folder, found, joints = tmp_path_factory.mktemp("three"), {}, (*JOINTS, "wrist")
    urdf = write_urdf(folder / "arm.urdf", {"shoulder": None, "elbow": "shoulder", "wrist": "elbow"})
    motion = ArmMotion(urdf, joints, seconds=8.0)
    topics = {"/joint_states": motion.states(joints), "/motor_command": motion.commands(joints)}
    bag = write_arm_bag(folder / "arm.mcap", motion.times, topics)
    text = urdf.read_text()
    last = text.index('<link name="wrist_link">')
    for name, mass in (("right", 2.0), ("lacking", 1.7)):
        other = folder / f"{name}.urdf"
        other.write_text(text[:last] + text[last:].replace('value="2"', f'value="{mass}"', 1))
        assert main(["init", str(other), str(bag), "-o", str(folder / "own.yaml"), "--unit", "A"]) == 0
        robot = load_robot(folder / "own.yaml")
        found[name] = calibrate(robot, [read_recording(bag, robot)])
    return found


@pytest.mark.slow
def test_a_load_that_the_urdf_lacks_is_no_good_result(three_joints):
    lacking = three_joints["lacking"]
    constants = [p.value for p in lacking.parameters if p.name.endswith("torque_constant")]
    assert max(abs(value - 1.0) for value in constants) > 0.08
    assert max(channel.chi2 for channel in lacking.channels.values()) < 1.2  # no residual shows it
    level, text = plausible_torques(lacking)
    assert level == "bad"
    told = re.search(r"the link that wrist moves weighs (\S+) kg, not the 1.70 kg of lacking.urdf", text)
    assert told is not None and float(told[1]) == pytest.approx(2.0, rel=0.02), text


@pytest.mark.slow
def test_a_link_that_is_named_is_added_and_nothing_else_is_said(three_joints):
    lacking = three_joints["lacking"]
    assert "link_mass@wrist" in plausible_torques(lacking)[1]
    assert missing_effects(lacking)[0] == "info"


@pytest.mark.slow
def test_right_masses_are_not_doubted(three_joints):
    assert plausible_torques(three_joints["right"]) == (
        "good",
        "Nothing speaks against the masses of the URDF, to which all values here are in proportion.",
    )


def doubted(robot, value, sigma, mass):
    """A calibration with one torque constant, and a link whose mass it doubts."""
    return dataclasses.replace(
        fake_calibration(0.2),
        robot=robot,
        start=robot,
        parameters=(ParameterEstimate("elbow.torque_constant", value, sigma, "N m/A", value, value, value),),
        masses=(mass,),
    )


@pytest.mark.parametrize(
    ("p_value", "change", "level"),
    [(1e-6, 0.05, "bad"), (1e-6, 0.015, "good"), (1e-3, 0.05, "good"), (1e-6, 1e-3, "good")],
)
def test_a_wrong_mass_must_be_sure_and_must_matter(arm, tmp_path, p_value, change, level):
    robot = begun(arm, tmp_path, 1.0, None, "--unit", "A")
    result = doubted(robot, 8.0, 0.01, WrongMass("elbow", 0.3, 0.02, p_value, {"elbow.torque_constant": 8.0 * change}))
    found, text = plausible_torques(result)
    assert found == level
    if level == "bad":
        assert "elbow.torque_constant would be +5 %" in text and re.search(r"jointscope init \S*/other.urdf ", text)


@pytest.mark.parametrize(("load", "level"), [(None, "bad"), (0.0, "bad"), (9.81, "good")])
def test_known_loads_at_rest_set_the_scale_of_masses_and_torque_constants(arm, tmp_path, load, level):
    robot = begun(arm, tmp_path, 1.0, None, "--unit", "A")
    path = tmp_path / "heavier.yaml"
    assert main(["add", str(robot.path), "link_mass@elbow", "-o", str(path)]) == 0
    result = doubted(load_robot(path), 8.0, 0.01, WrongMass("elbow", 0.3, 0.02, 0.5, {}))
    if load is not None:
        rests = SimpleNamespace(rests=SimpleNamespace(forces=np.array([[0.0, 0.0, -load]])))
        result = dataclasses.replace(result, rests=SeenRests(robot, robot, [rests], (), None, (), ()))
    assert plausible_torques(result)[0] == level


@pytest.mark.parametrize(("p_value", "level"), [(1e-20, "good"), (1e-9, "bad")])
def test_an_effect_that_is_far_surer_than_a_mass_is_said_in_its_place(arm, tmp_path, p_value, level):
    robot = begun(arm, tmp_path, 1.0, None, "--unit", "A")
    constant = "elbow.torque_constant"
    heavy = doubted(robot, 8.0, 0.01, WrongMass("elbow", 0.3, 0.02, 1e-8, {constant: 0.4}))
    hardens = LackingEffect("spring_cubic", "elbow", p_value, 100.0, {constant: 7.0})
    assert plausible_torques(dataclasses.replace(heavy, lacking=(hardens,)))[0] == level
    same = dataclasses.replace(hardens, with_it={constant: 8.0})  # and changes no value
    assert plausible_torques(dataclasses.replace(heavy, lacking=(same,)))[0] == "bad"


@pytest.mark.parametrize(
    ("value", "mass", "said"),
    [
        (0.6, -0.9, "Add the load .*own_anew.yaml`. Or its commands are torques, .* --unit Nm -o \\S*/own_anew.yaml`"),
        (0.6, 0.9, "another mass behind elbow, by +0.9 ± 0.03 kg.*-o \\S*/own_anew.yaml`.$"),
        (8.0, -0.9, "another mass behind elbow, by -0.9 ± 0.03 kg.*-o \\S*/own_anew.yaml`.$"),
        (
            8.0,
            0.05,
            "weight at another place behind elbow.*`jointscope add \\S*/own.yaml "
            "gravity_direction@robot -o \\S*/own_gravity_direction.yaml`",
        ),
    ],
)
def test_weight_has_other_reasons_than_a_load(arm, tmp_path, value, mass, said):
    robot = begun(arm, tmp_path, 1.0, None, "--unit", "A")
    result = doubted(robot, value, 1e-3, WrongMass("elbow", mass, 0.03, 1e-9, {"elbow.torque_constant": 0.05 * value}))
    level, text = plausible_torques(result)
    assert level == "bad" and re.search(said.replace("+", r"\+"), text), text


def test_masses_beside_free_torque_constants_have_no_scale(arm, tmp_path):
    robot = add_effects(begun(arm, tmp_path, 1.0, None, "--unit", "A"), ["link_mass@elbow"]).robot
    level, text = asked(robot, (8.0, 12.0))
    assert level == "bad"
    assert "link_mass@elbow" in text and "fixed: true" in text
    assert asked(robot)[0] == "good"
