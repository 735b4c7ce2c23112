# SPDX-License-Identifier: BSD-3-Clause
"""Several effects added and removed at once, the spring that some of them need, and files as `init` writes them."""

from __future__ import annotations

import pytest

from jointscope.robots.errors import EffectError, RobotError
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import remove_effect
from jointscope.robots.files.effects_at_once import add_effects, remove_effects, without_effects
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.command_words import ready_robots

URDF = """<robot name="crane"><link name="base"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="column"/><axis xyz="0 0 1"/>
 <limit effort="12" velocity="10" lower="-3" upper="3"/></joint>
<link name="column"><inertial><mass value="3"/>
 <inertia ixx="0.12" iyy="0.12" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="reach" type="prismatic"><parent link="column"/><child link="boom"/><axis xyz="1 0 0"/>
 <limit effort="40" velocity="4" lower="-0.5" upper="0.5"/></joint>
<link name="boom"><inertial><mass value="2"/>
 <inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
CRANE = """# written by init
format: 1
name: crane
urdf: crane.urdf
gravity: [0.0, 0.0, -9.81]
joints: [turn, reach]

model:
  integrator: simpson                           # euler | midpoint | simpson
  rigid_joints: [turn, reach]                   # `jointscope discover` finds which joints are elastic

command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}

sensors:
  enc: {kind: motor_encoder, topic: /joint_states, type: sensor_msgs/msg/JointState, field: position,
        unit: [rad, m], sigma: [7.0e-5, 5.0e-6]}

parameters:                                     # GUESS: start values by regression
  turn.coulomb_torque: {value: 0.5, unit: N m, prior_sigma: 1.0}
  turn.inertia: {value: 0.05, unit: kg m2, prior_sigma: 0.1}
  reach.coulomb_torque: {value: 4.0, unit: N, prior_sigma: 8.0}
  reach.inertia: {value: 1.0, unit: kg, prior_sigma: 2.0}

# random torques
noise:
  estimate: true
  link_velocity: [0.35, 0.35]
  motor_velocity: [0.26, 0.26]
"""


@pytest.fixture
def crane(tmp_path):
    """A rigid robot that turns and slides, without a gyroscope, without effects."""
    (tmp_path / "crane.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "crane.yaml").write_text(CRANE, encoding="utf-8")
    return load_robot(tmp_path / "crane.yaml")


def reread(robot):
    """The robot as its file gives it back."""
    (robot.path.parent / "again.yaml").write_text(robot_text(robot, robot.path.parent), encoding="utf-8")
    return load_robot(robot.path.parent / "again.yaml")


def labels(robot):
    return [here.label for here in robot.effects]


def test_a_star_means_every_joint_and_every_gyro(doggy):
    edited = add_effects(doggy, ["motor_viscous@*", "gyro_scale@*", "cogging@joint2"])
    joints = ["motor_viscous@joint1", "motor_viscous@joint2", "motor_viscous@joint3"]
    assert list(edited.labels) == labels(edited.robot)
    assert sorted(edited.labels) == sorted([*joints, "gyro_scale@imu1", "gyro_scale@imu2", "cogging@joint2"])
    assert edited.skipped == {} and edited.brought == {}
    assert add_effects(doggy, ["motor_viscous@all"]).labels == tuple(joints)


def test_what_is_there_or_cannot_be_is_skipped_with_its_reason(doggy, crane):
    first = add_effects(doggy, ["cogging@joint2"]).robot
    edited = add_effects(first, ["cogging@*"])
    assert edited.labels == ("cogging@joint1", "cogging@joint3")
    assert edited.skipped == {"cogging@joint2": "is there already"}
    edited = add_effects(crane, ["bearing_flexibility@*"])
    assert edited.labels == ("bearing_flexibility@turn",)
    assert edited.skipped == {"bearing_flexibility@reach": "acts on turn"}


def test_a_joint_that_is_named_beside_a_star_is_added_once(doggy):
    assert sorted(add_effects(doggy, ["cogging@*", "cogging@joint2"]).labels) == [
        f"cogging@joint{i}" for i in (1, 2, 3)
    ]


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        (["gyro_scale@*"], "gyro_scale@*: crane has no gyro that it could act on"),
        (["banana@*"], "no effect 'banana'; `jointscope effects` lists all, --effects FILE.py adds your own"),
        (["motor_viscous@turn", "motor_viscous@turn"], "motor_viscous@turn is named twice; name each effect once"),
        (["motor_viscous@*", "cogging@elbow"], "effect 'cogging@elbow': cogging acts on turn, reach"),
        (
            ["coriolis@*"],
            "coriolis@*: nothing to be added to crane: coriolis@robot: is part of the model already: "
            "the robot file says coriolis: true",
        ),
    ],
)
def test_nothing_to_add_is_an_error_that_says_why(crane, wanted, message):
    with pytest.raises(EffectError) as error:
        add_effects(crane, wanted)
    assert str(error.value) == message


def test_nothing_left_of_a_star_lists_all_reasons(doggy):
    both = add_effects(doggy, ["gyro_scale@*"]).robot
    with pytest.raises(EffectError) as error:
        add_effects(both, ["gyro_scale@*"])
    assert str(error.value) == (
        "gyro_scale@*: nothing to be added to doggy: gyro_scale@imu1: is there already; "
        "gyro_scale@imu2: is there already"
    )
    with pytest.raises(EffectError, match="joint1, which has a spring already"):
        add_effects(doggy, ["joint_elasticity@*"])


@pytest.mark.parametrize("effect", ["backlash", "spring_cubic", "hysteresis", "kinematic_coupling"])
def test_an_effect_of_a_spring_brings_the_spring_to_a_rigid_joint(crane, effect):
    edited = add_effects(crane, [f"{effect}@reach"])
    assert edited.labels == ("joint_elasticity@reach", f"{effect}@reach")
    assert edited.brought == {"joint_elasticity@reach": f"{effect}@reach"}
    assert edited.robot.layout.motors == ("reach",)
    again = reread(edited.robot)
    assert labels(again) == list(edited.labels)
    assert again.parameters["reach.joint_elasticity.compliance"].unit == "m/N"
    named = add_effects(crane, [f"{effect}@*", "joint_elasticity@reach"])
    assert named.brought == {"joint_elasticity@turn": f"{effect}@turn"}


def test_every_effect_of_the_catalogue_can_be_added_and_leaves_no_trace(crane):
    before = robot_text(crane, crane.path.parent)
    wanted = []
    # a spring has one dead zone, and backlash is one; it has one curve
    for effect in [name for name in catalogue() if name != "spring_slack" and "spring_pieces" not in name]:
        try:
            wanted += add_effects(crane, [f"{effect}@*"]).labels
        except EffectError:
            continue  # nothing that it could act on
    assert len(set(wanted)) > 30
    edited = add_effects(crane, list(dict.fromkeys(wanted)))
    assert labels(reread(edited.robot)) == list(edited.labels)
    assert robot_text(without_effects(edited.robot), crane.path.parent) == before


def test_a_spring_stays_while_something_acts_in_it(crane):
    robot = add_effects(crane, ["backlash@turn", "joint_elasticity@reach"]).robot
    with pytest.raises(EffectError) as error:
        remove_effect(robot, "joint_elasticity@turn")
    assert str(error.value) == (
        "joint_elasticity@turn cannot be removed from crane: backlash@turn acts in that spring; remove both: "
        f"jointscope remove {crane.path} backlash@turn joint_elasticity@turn "
        f"-o {crane.path.with_name('crane_without.yaml')}"
    )
    edited = remove_effects(robot, ["joint_elasticity@*"])
    assert edited.labels == ("joint_elasticity@reach",)
    assert edited.skipped == {"joint_elasticity@turn": "backlash@turn needs it"}
    for order in (["joint_elasticity@turn", "backlash@turn"], ["backlash@*", "joint_elasticity@*"]):
        left = remove_effects(robot, order).robot
        assert "backlash@turn" not in labels(left) and "joint_elasticity@turn" not in labels(left)
    assert without_effects(robot).parameters == crane.parameters


def test_a_file_with_an_effect_of_a_spring_on_a_rigid_joint_is_refused(crane):
    text = CRANE.replace("# random", "  turn.backlash.half_gap: {value: 0.001, unit: rad}\n\n# random")
    (crane.path.parent / "bad.yaml").write_text(text + "effects: [backlash@turn]\n", encoding="utf-8")
    with pytest.raises(RobotError) as error:
        load_robot(crane.path.parent / "bad.yaml")
    assert str(error.value) == (
        "bad.yaml: effects: backlash@turn acts in a spring, and turn is declared rigid; take backlash@turn and its "
        "parameters out, then `jointscope add` brings it with joint_elasticity@turn"
    )


def test_removing_the_last_effect_leaves_a_file_that_can_be_read(crane):
    text = CRANE + "effects: [cogging@turn]   # in brackets\n"
    new = "  turn.cogging.cos: {value: 0.0, unit: N m, positive: false}\n"
    new += (
        "  turn.cogging.sin: {value: 0.0, unit: N m, positive: false}\n  turn.cogging.order: {value: 7.0, unit: '1'}\n"
    )
    (crane.path.parent / "one.yaml").write_text(text.replace("\n# random", new + "\n# random"), encoding="utf-8")
    robot = load_robot(crane.path.parent / "one.yaml")
    both = add_effects(robot, ["motor_viscous@turn"]).robot
    assert "effects: [cogging@turn, motor_viscous@turn]" in robot_text(both, crane.path.parent)
    left = reread(remove_effects(both, ["cogging@*", "motor_viscous@*"]).robot)
    assert left.effects == () and left.parameters.keys() == crane.parameters.keys()
    assert "effects" not in robot_text(left, crane.path.parent)
    assert "# random torques" in robot_text(left, crane.path.parent)


def test_a_robot_without_parameters_gets_its_first_and_loses_it_again(tmp_path):
    text = ready_robots()["hebi_2r"].read_text(encoding="utf-8").replace("urdf: hebi", "urdf: ready:hebi_2r/hebi")
    path = tmp_path / "hebi.yaml"
    path.write_text(text, encoding="utf-8")
    robot = load_robot(path)
    assert dict(robot.parameters) == {}
    edited = add_effects(robot, ["joint_elasticity@*"])
    left = reread(remove_effects(reread(edited.robot), list(edited.labels)).robot)
    assert dict(left.parameters) == {} and left.effects == ()
