# SPDX-License-Identifier: BSD-3-Clause
"""`init`: which joints are the robot's, where all others are held, and what to type where that cannot be known."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from arm_bags import ArmMotion, write_arm_bag, write_urdf

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main

ARM = {"shoulder": None, "elbow": "shoulder", "wrist": "elbow"}
CASES = Path(__file__).resolve().parents[3].parent / "shared" / "cases"
needs_cases = pytest.mark.skipif(not CASES.is_dir(), reason="shared/cases is not beside the project")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("arms")


@pytest.fixture(scope="module")
def arm(folder):
    return write_urdf(folder / "arm.urdf", ARM)


@pytest.fixture(scope="module")
def held(arm):
    """Shoulder and elbow move, the wrist stands."""
    return ArmMotion(arm, ("shoulder", "elbow"), {"wrist": -1.019})


@pytest.fixture(scope="module")
def free(arm):
    """All three move."""
    return ArmMotion(arm, tuple(ARM))


def init(*arguments):
    return main(["init", *map(str, arguments)])


def test_a_joint_that_stands_is_locked_where_it_stands_though_it_is_commanded(arm, held, tmp_path, capsys):
    topics = {"/joint_states": held.states(), "/motor_command": held.commands(tuple(ARM))}
    bag = write_arm_bag(tmp_path / "a.mcap", held.times, topics)
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 0
    robot = load_robot(tmp_path / "a.yaml")
    assert robot.joints == ("shoulder", "elbow")
    assert robot.tree.locked == {"wrist": pytest.approx(-1.019, abs=1e-4)}
    assert "locked: wrist -1.019 (stand still in the recording)" in capsys.readouterr().out


def test_commands_for_some_joints_drive_those(arm, held, tmp_path):
    topics = {"/joint_states": held.states(), "/motor_command": held.commands(("elbow", "shoulder"))}
    bag = write_arm_bag(tmp_path / "a.mcap", held.times, topics)
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 0
    robot = load_robot(tmp_path / "a.yaml")
    assert robot.joints == ("shoulder", "elbow") and "wrist" in robot.tree.locked
    np.testing.assert_allclose(read_recording(bag, robot).command.values, held.torque)


def test_joints_that_the_bag_does_not_know_are_assumed_at_zero_and_said(arm, held, tmp_path, capsys):
    states = held.states(("shoulder", "elbow"))
    bag = write_arm_bag(
        tmp_path / "a.mcap", held.times, {"/joint_states": states, "/cmd": held.commands(("shoulder", "elbow"))}
    )
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 0
    assert load_robot(tmp_path / "a.yaml").tree.locked == {"wrist": 0.0}
    assert "wrist (assumed at 0: not in the bag)" in capsys.readouterr().out


def test_a_joint_that_creeps_within_its_noise_and_gives_way_a_little_stands(arm, held, tmp_path, capsys):
    states = held.states()
    column = states["names"].index("wrist")
    sag = 0.004 * np.sin(5.0 * held.times) + 0.003 * held.times / held.times[-1]
    states["position"][:, column] += sag
    bag = write_arm_bag(tmp_path / "a.mcap", held.times, {"/joint_states": states, "/cmd": held.commands(tuple(ARM))})
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 0
    mean = load_robot(tmp_path / "a.yaml").tree.locked["wrist"]
    assert mean == pytest.approx(-1.019 + sag.mean(), abs=1e-4)
    assert re.search(r"wrist: .* # GUESS: stands still there, moves by 0\.01", (tmp_path / "a.yaml").read_text())


def commands_in(message):
    """What an error says to type."""
    return [shlex.split(part) for part in re.findall(r"type: (jointscope [^;]*)", message)]


def test_a_moving_joint_that_is_left_out_is_refused_with_commands_that_work(arm, free, tmp_path, capsys):
    bag = write_arm_bag(
        tmp_path / "a b.mcap", free.times, {"/joint_states": free.states(), "/cmd": free.commands(tuple(ARM))}
    )
    assert init(arm, bag, "--joints", "shoulder,elbow", "-o", tmp_path / "a.yaml") == 1
    message = capsys.readouterr().err
    assert "wrist (by " in message and "--joints leaves it out" in message
    assert not (tmp_path / "a.yaml").exists()
    use, hold = commands_in(message)
    assert main(use[1:]) == 0 and load_robot(tmp_path / "a.yaml").joints == tuple(ARM)
    assert main(hold[1:]) == 0
    robot = load_robot(tmp_path / "a.yaml")
    assert robot.joints == ("shoulder", "elbow")
    assert robot.tree.locked["wrist"] == pytest.approx(free.position["wrist"].mean(), abs=1e-3)
    assert "--lock says so" in (tmp_path / "a.yaml").read_text()


def test_a_moving_joint_that_nothing_drives_is_refused_with_a_command_that_works(arm, free, tmp_path, capsys):
    bag = write_arm_bag(
        tmp_path / "a.mcap",
        free.times,
        {"/joint_states": free.states(), "/cmd": free.commands(("shoulder", "elbow"))},
    )
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 1
    message = capsys.readouterr().err
    assert "nothing in the bag drives it" in message
    (hold,) = commands_in(message)
    assert main(hold[1:]) == 0
    assert load_robot(tmp_path / "a.yaml").joints == ("shoulder", "elbow")


def test_joints_on_other_branches_do_not_matter(tmp_path):
    urdf = write_urdf(tmp_path / "two.urdf", {"a1": None, "a2": "a1", "b1": None, "b2": "b1"})
    motion = ArmMotion(urdf, ("a1", "a2", "b1"), {"b2": 0.3})
    topics = {"/joint_states": motion.states(), "/cmd": motion.commands(("a1", "a2"))}
    bag = write_arm_bag(tmp_path / "a.mcap", motion.times, topics)
    assert init(urdf, bag, "-o", tmp_path / "a.yaml") == 0
    robot = load_robot(tmp_path / "a.yaml")
    assert robot.joints == ("a1", "a2") and robot.tree.locked == {}


def test_a_recording_in_which_nobody_moves_is_refused(arm, tmp_path, capsys):
    motion = ArmMotion(arm, ("shoulder",), {"elbow": 1.0, "wrist": 0.2})
    motion.position["shoulder"] = np.full(len(motion.times), 0.4) + 1e-5 * np.sin(np.arange(len(motion.times)))
    bag = write_arm_bag(
        tmp_path / "a.mcap", motion.times, {"/joint_states": motion.states(), "/cmd": motion.commands(("shoulder",))}
    )
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 1
    assert "no joint moves in the recording" in capsys.readouterr().err


def test_names_that_end_alike_are_matched_whatever_their_order(arm, held, tmp_path):
    states = {"shoulder": "robot::arm/Shoulder", "elbow": "robot::arm/Elbow", "wrist": "robot::arm/Wrist"}
    commands = {"shoulder": "SHOULDER_joint", "elbow": "ELBOW_joint"}
    topics = {
        "/joint_states": held.states(("wrist", "elbow", "shoulder"), states),
        "/cmd": held.commands(("elbow", "shoulder"), commands),
    }
    bag = write_arm_bag(tmp_path / "a.mcap", held.times, topics)
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 0
    robot = load_robot(tmp_path / "a.yaml")
    recording = read_recording(bag, robot)
    np.testing.assert_allclose(recording.command.values, held.torque)
    np.testing.assert_allclose(recording.streams["motor_encoder"].values, held.q, atol=1e-3)
    assert robot.tree.locked["wrist"] == pytest.approx(-1.019, abs=1e-4)


def test_names_that_could_be_two_joints_are_refused_until_one_is_named(tmp_path, capsys):
    urdf = write_urdf(tmp_path / "two.urdf", {"left_joint1": None, "right_joint1": None})
    motion = ArmMotion(urdf, ("left_joint1",))
    called = {"left_joint1": "joint1"}
    topics = {
        "/joint_states": motion.states(called=called),
        "/cmd": motion.commands(("left_joint1",), called),
    }
    bag = write_arm_bag(tmp_path / "a.mcap", motion.times, topics)
    assert init(urdf, bag, "-o", tmp_path / "a.yaml") == 1
    message = capsys.readouterr().err
    assert "joint1 of /joint_states could be left_joint1 or right_joint1 of the URDF" in message
    assert "--joints left_joint1=joint1" in message
    assert init(urdf, bag, "--joints", "left_joint1=joint1", "-o", tmp_path / "a.yaml") == 0
    assert load_robot(tmp_path / "a.yaml").motor_encoder.source.names == ("joint1",)


def test_an_array_of_commands_is_taken_in_the_order_of_the_urdf_and_marked(arm, held, tmp_path):
    values = held.commands(("shoulder", "elbow", "wrist"))["effort"]
    for name, data in (("all", values), ("moving", values[:, :2])):
        topics = {"/joint_states": held.states(), "/effort_controller/commands": {"data": data}}
        bag = write_arm_bag(tmp_path / f"{name}.mcap", held.times, topics)
        assert init(arm, bag, "-o", tmp_path / f"{name}.yaml") == 0
        robot = load_robot(tmp_path / f"{name}.yaml")
        np.testing.assert_allclose(read_recording(bag, robot).command.values, held.torque)
        text = (tmp_path / f"{name}.yaml").read_text()
        assert re.search(r"command: .* # GUESS: .* its columns are taken in the order of the URDF", text)


def test_an_array_of_commands_in_another_order_is_put_in_that_of_the_motion(arm, held, free, tmp_path):
    for name, motion, order in (("three", free, ("wrist", "shoulder", "elbow")), ("two", held, ("elbow", "shoulder"))):
        topics = {
            "/joint_states": motion.states(),
            "/effort_controller/commands": {"data": motion.commands(order)["effort"]},
        }
        bag = write_arm_bag(tmp_path / f"{name}.mcap", motion.times, topics)
        assert init(arm, bag, "-o", tmp_path / f"{name}.yaml") == 0
        np.testing.assert_allclose(
            read_recording(bag, load_robot(tmp_path / f"{name}.yaml")).command.values, motion.torque
        )
        assert "the motion asks for this order" in (tmp_path / f"{name}.yaml").read_text()


@pytest.mark.parametrize("kind", ["std_msgs/msg/Float64", "std_msgs/msg/Float32", "std_msgs/msg/Float64MultiArray"])
def test_commands_on_a_topic_for_each_joint_are_put_together(arm, held, tmp_path, capsys, kind):
    topics = {"/joint_states": held.states()}
    for joint in ("elbow", "shoulder"):  # not the order of the URDF
        topics[f"/{joint}_controller/command"] = {"type": kind, "data": held.commands((joint,))["effort"]}
    bag, out = write_arm_bag(tmp_path / "a.mcap", held.times, topics), tmp_path / "a.yaml"
    assert init(arm, bag, "-o", out) == 0
    text = capsys.readouterr().out
    assert "no role found" not in text and "can be used with it" in text
    robot = load_robot(out)
    assert robot.command.topic == "/shoulder_controller/command + /elbow_controller/command"
    command = read_recording(bag, robot).command
    np.testing.assert_allclose(command.values, held.torque, rtol=1e-6)
    np.testing.assert_allclose(np.diff(command.times), np.diff(held.times), atol=1e-6)
    blocks = list(ArrivalReader(bag, robot))
    place = blocks[0].names.index("command")
    np.testing.assert_allclose(np.vstack([block.values[place] for block in blocks]), held.torque, rtol=1e-6)


def test_an_array_that_holds_joints_that_stand_drives_those_that_move(arm, held, tmp_path, capsys):
    """A controller has one value for each of its joints, and no bag says which it has beside those that move."""
    efforts = held.commands(("shoulder", "elbow"))["effort"]
    still = np.full(len(efforts), 0.7)
    topics = {"/joint_states": held.states()}
    topics["/effort_controller/commands"] = {
        "data": np.column_stack([still, efforts[:, 0], 0.0 * still, efforts[:, 1]])
    }
    bag, out = write_arm_bag(tmp_path / "a.mcap", held.times, topics), tmp_path / "a.yaml"
    assert init(arm, bag, "-o", out) == 0
    assert "can be used with it" in capsys.readouterr().out
    np.testing.assert_allclose(read_recording(bag, load_robot(out)).command.values, efforts)


@pytest.mark.parametrize("together", [True, False])
def test_goal_positions_are_no_drive(arm, held, tmp_path, together):
    """Position controllers command where to be; what drives the motors is the effort beside the positions."""
    late = {joint: np.interp(held.times + 0.04, held.times, held.position[joint]) for joint in ("shoulder", "elbow")}
    names = ("shoulder", "elbow", "wrist")
    effort = held.commands(names)["effort"]
    topics = {"/joint_states": {**held.states(names), "effort": effort}}
    if together:
        topics["/position_controller/commands"] = {"data": np.column_stack([late["shoulder"], late["elbow"]])}
    else:
        for joint, goal in late.items():
            topics[f"/{joint}_controller/command"] = {"type": "std_msgs/msg/Float64", "data": goal[:, None]}
    bag, out = write_arm_bag(tmp_path / "a.mcap", held.times, topics), tmp_path / "a.yaml"
    assert init(arm, bag, "-o", out) == 0
    robot = load_robot(out)
    assert (robot.command.topic, robot.command.field) == ("/joint_states", "effort")


def test_a_topic_of_joined_ones_that_is_missing_is_named(arm, held, tmp_path, capsys):
    topics = {"/joint_states": held.states()}
    for joint in ("elbow", "shoulder"):
        topics[f"/{joint}_controller/command"] = {
            "type": "std_msgs/msg/Float64",
            "data": held.commands((joint,))["effort"],
        }
    bag, out = write_arm_bag(tmp_path / "a.mcap", held.times, topics), tmp_path / "a.yaml"
    assert init(arm, bag, "-o", out) == 0
    del topics["/elbow_controller/command"]
    other = write_arm_bag(tmp_path / "b.mcap", held.times, topics)
    with pytest.raises(RecordingError, match=r"b.mcap: topic /elbow_controller/command is missing"):
        read_recording(other, load_robot(out))
    assert main(["info", str(other), "--robot", str(out)]) == 0
    assert "topic /elbow_controller/command is missing" in capsys.readouterr().out


def test_arrays_of_motors_are_read(arm, held, tmp_path):
    names = ("shoulder", "elbow", "wrist")
    low = {"type": "own_msgs/msg/LowState", "position": held.states(names)["position"]}
    low["effort"] = held.commands(names)["effort"]
    bag = write_arm_bag(tmp_path / "a.mcap", held.times, {"/lowstate": low})
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 0
    robot = load_robot(tmp_path / "a.yaml")
    assert robot.motor_encoder.source.field == "motor_state.*.q"
    recording = read_recording(bag, robot)
    np.testing.assert_allclose(recording.streams["motor_encoder"].values, held.q, atol=1e-3)
    np.testing.assert_allclose(recording.command.values, held.torque, atol=1e-4)
    assert robot.tree.locked["wrist"] == pytest.approx(-1.019, abs=1e-4)


def test_states_that_name_interfaces_are_read(arm, held, tmp_path):
    names = ("wrist", "elbow", "shoulder")
    state = {**held.states(names), **held.commands(names), "type": "control_msgs/msg/DynamicJointState"}
    bag = write_arm_bag(tmp_path / "a.mcap", held.times, {"/dynamic_joint_states": state})
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 0
    robot = load_robot(tmp_path / "a.yaml")
    recording = read_recording(bag, robot)
    np.testing.assert_allclose(recording.streams["motor_encoder"].values, held.q, atol=1e-3)
    np.testing.assert_allclose(recording.command.values, held.torque)


def test_mimic_joints_are_no_joints_of_the_robot(tmp_path, capsys):
    parents = {"shoulder": None, "finger_1": "shoulder", "finger_2": "shoulder"}
    urdf = write_urdf(tmp_path / "hand.urdf", parents, {"finger_2": "finger_1"})
    motion = ArmMotion(urdf, ("shoulder", "finger_1"))
    motion.position["finger_2"] = -motion.position["finger_1"]
    topics = {"/joint_states": motion.states(), "/cmd": motion.commands(("shoulder", "finger_1"))}
    bag = write_arm_bag(tmp_path / "a.mcap", motion.times, topics)
    assert init(urdf, bag, "-o", tmp_path / "a.yaml") == 0
    assert load_robot(tmp_path / "a.yaml").joints == ("shoulder", "finger_1")
    assert "finger_2 follows finger_1" in capsys.readouterr().out
    assert init(urdf, bag, "--joints", "shoulder,finger_2", "-o", tmp_path / "b.yaml") == 1
    assert "finger_2 follows finger_1 and is modelled with it" in capsys.readouterr().err


@pytest.mark.parametrize(("factor", "said"), [(-1.0, False), (0.0, False), (1.0, True), (-0.5, True)])
def test_a_mimic_joint_that_follows_otherwise_than_its_urdf_says_is_told(factor, said, tmp_path, capsys):
    parents = {"shoulder": None, "finger_1": "shoulder", "finger_2": "shoulder"}
    urdf = write_urdf(tmp_path / "hand.urdf", parents, {"finger_2": "finger_1"})
    motion = ArmMotion(urdf, ("shoulder", "finger_1"))
    motion.position["finger_2"] = factor * motion.position["finger_1"]
    topics = {"/joint_states": motion.states(), "/cmd": motion.commands(("shoulder", "finger_1"))}
    bag = write_arm_bag(tmp_path / "a.mcap", motion.times, topics)
    assert init(urdf, bag, "-o", tmp_path / "a.yaml") == 0
    told = f"with multiplier -1 and offset 0, but in the bag with {factor:g} and 0" in capsys.readouterr().out
    assert told == said


@needs_cases
@pytest.mark.parametrize(
    ("name", "urdf", "joints", "locked"),
    [
        ("arm_held_wrist", "arm_held_wrist", ("shoulder", "elbow"), {"wrist": -1.0192}),
        ("arm_group_command", "arm_held_wrist", ("shoulder", "elbow"), {"wrist": -1.0192}),
        ("held_elbow", "held_elbow", ("shoulder",), {"elbow": 2.0}),
        ("mimic", "mimic", ("shoulder",), {}),
        ("arm_viscous", "arm_viscous", ("shoulder", "elbow", "wrist"), {}),
        ("dual_arm_joint_names", "dual", ("a_right", "b_left"), {}),
    ],
)
def test_the_cases_get_their_joints(name, urdf, joints, locked, tmp_path):
    assert init(CASES / f"{urdf}.urdf", CASES / f"{name}.mcap", "-o", tmp_path / "a.yaml") == 0
    robot = load_robot(tmp_path / "a.yaml")
    assert robot.joints == joints
    assert robot.tree.locked == pytest.approx(locked, abs=1e-3)


@needs_cases
def test_links_and_joints_may_have_the_same_names(tmp_path):
    arguments = (CASES / "arm_same_names.urdf", CASES / "arm_same_names.mcap", "--joints", "shoulder,elbow")
    assert init(*arguments, "-o", tmp_path / "a.yaml") == 0
    assert load_robot(tmp_path / "a.yaml").tree.locked == pytest.approx({"wrist": -1.0192}, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("moving", [("finger",), ("arm", "finger")])
def test_a_finger_without_a_mass_has_that_of_its_rotor(moving, tmp_path, capsys):
    text = write_urdf(tmp_path / "g.urdf", {"arm": None, "finger": "arm"}).read_text()
    before, link, after = text.partition('<link name="finger_link">')
    (tmp_path / "g.urdf").write_text(before + link + re.sub("<inertial>.*?</inertial>", "", after, count=1))
    still = {} if "arm" in moving else {"arm": 0.3}
    motion = ArmMotion(tmp_path / "g.urdf", moving, still)
    bag = write_arm_bag(tmp_path / "a.mcap", motion.times, {"/s": motion.states(), "/cmd": motion.commands(moving)})
    assert init(tmp_path / "g.urdf", bag, "-o", tmp_path / "a.yaml") == 0
    said = capsys.readouterr().out
    assert "g.urdf: link finger_link, moved by finger, has no inertia; its rotor has it all" in said
    robot = load_robot(tmp_path / "a.yaml")
    assert robot.tree.massless == ("finger",) and robot.command.unit == "N m"
    assert catalogue()["link_mass"].owners_of(robot) == moving[:-1]  # others are asked for theirs
    assert catalogue()["inertia_error"].owners_of(robot) == moving[:-1] and not catalogue()["payload"].owners_of(robot)
    start = {name: parameter.value for name, parameter in robot.parameters.items()}
    assert start["finger.inertia"] == pytest.approx(0.05, rel=0.05)  # the commands are held
    assert start["finger.coulomb_torque"] == pytest.approx(0.3, rel=0.05)
    assert main(["calibrate", str(tmp_path / "a.yaml"), str(bag), "-o", str(tmp_path / "c.yaml")]) == 0
    found = load_robot(tmp_path / "c.yaml").parameters["finger.inertia"]
    assert found.value == pytest.approx(0.05, rel=0.04)


def test_a_spring_needs_an_inertia_behind_it(tmp_path, capsys):
    text = write_urdf(tmp_path / "g.urdf", {"finger": None}).read_text()
    (tmp_path / "g.urdf").write_text(re.sub("<inertial>.*?</inertial>", "", text, count=1))
    motion = ArmMotion(tmp_path / "g.urdf", ("finger",))
    bag = write_arm_bag(tmp_path / "a.mcap", motion.times, {"/s": motion.states(), "/c": motion.commands(("finger",))})
    assert init(tmp_path / "g.urdf", bag, "-o", tmp_path / "a.yaml") == 0
    capsys.readouterr()
    assert main(["add", str(tmp_path / "a.yaml"), "joint_elasticity@finger", "-o", str(tmp_path / "b.yaml")]) == 1
    assert "which moves no inertia in the URDF: nothing would swing on the spring" in capsys.readouterr().err
    own = (tmp_path / "a.yaml").read_text()
    (tmp_path / "a.yaml").write_text(re.sub("rigid_joints: .finger.", "rigid_joints: []", own))
    assert main(["info", str(bag), "--robot", str(tmp_path / "a.yaml")]) == 1
    assert "finger moves no inertia in g.urdf, so nothing swings on a spring" in capsys.readouterr().err


def test_a_joint_that_is_driven_and_whose_encoder_says_nothing_is_no_joint_that_stands(arm, free, tmp_path, capsys):
    states = free.states()
    states["position"][:, states["names"].index("wrist")] = np.nan
    topics = {"/joint_states": states, "/motor_command": free.commands(tuple(ARM))}
    bag = write_arm_bag(tmp_path / "a.mcap", free.times, topics)
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 1
    told = capsys.readouterr().err
    assert "wrist: driven in" in told and "its position is no number (NaN) in most messages of /joint_states" in told
    assert main(shlex.split(told.partition("type: ")[2])[1:]) == 0
    assert "locked: wrist (assumed at 0: no number in the bag)" in capsys.readouterr().out


def test_a_joint_that_swings_to_one_side_is_held_at_its_mean_on_the_users_word(arm, free, tmp_path, capsys):
    states = free.states()
    wrist = states["names"].index("wrist")
    states["position"][:, wrist] = np.where(free.times < 1.0, 1.0, 0.2)
    topics = {"/joint_states": states, "/motor_command": free.commands(tuple(ARM))}
    bag = write_arm_bag(tmp_path / "a.mcap", free.times, topics)
    assert init(arm, bag, "-o", tmp_path / "a.yaml", "--joints", "shoulder,elbow", "--lock", "wrist") == 0
    robot = load_robot(tmp_path / "a.yaml")
    mean = float(np.mean(states["position"][:, wrist]))
    assert robot.tree.locked["wrist"] == pytest.approx(mean, abs=2e-3)
    assert read_recording(bag, robot).posture["wrist"] == pytest.approx(mean, abs=5e-3)


def test_a_lock_that_leaves_no_joint_and_names_given_twice_are_one_line(arm, free, tmp_path, capsys):
    topics = {"/joint_states": free.states(), "/motor_command": free.commands(tuple(ARM))}
    bag = write_arm_bag(tmp_path / "a.mcap", free.times, topics)
    for options, told in (
        (("--lock", "shoulder,elbow,wrist"), "--lock shoulder,elbow,wrist leaves no joint that moves and is driven"),
        (("--lock", "wrist,wrist"), "--lock names wrist twice; expected every joint once"),
        (("--joints", "shoulder,elbow,shoulder"), "--joints names shoulder twice; expected every joint once"),
    ):
        assert init(arm, bag, "-o", tmp_path / "a.yaml", *options) == 1
        assert told in capsys.readouterr().err


def test_counts_are_recognised_by_their_whole_numbers(arm, free, tmp_path, capsys):
    states = free.states()
    states["position"] = np.rint(states["position"] * 65536 / (2 * np.pi))
    topics = {"/joint_states": states, "/motor_command": free.commands(tuple(ARM))}
    bag = write_arm_bag(tmp_path / "a.mcap", free.times, topics)
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 0
    told = capsys.readouterr().out
    assert "write unit: rad and scale: [6.2832/COUNTS_PER_TURN, ...]" in told
    text = (tmp_path / "a.yaml").read_text()
    scaled = re.sub(r"\n    unit: deg.*", f"\n    unit: rad\n    scale: {[2 * np.pi / 65536] * 3}", text)
    (tmp_path / "b.yaml").write_text(scaled)
    values = read_recording(bag, load_robot(tmp_path / "b.yaml")).streams["motor_encoder"].values
    np.testing.assert_allclose(values, free.states(tuple(ARM))["position"], atol=6e-5)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', "error: changed.urdf: joint shoulder has no axis"),
        ('<mass value="2"/>', '<mass value="-2"/>', "has a negative inertia: principal moments"),
    ],
)
def test_what_is_wrong_in_the_urdf_is_not_taken_for_a_lack_of_masses(arm, free, tmp_path, capsys, old, new, told):
    urdf = tmp_path / "changed.urdf"
    urdf.write_text(arm.read_text().replace(old, new, 1))
    topics = {"/joint_states": free.states(), "/motor_command": free.commands(tuple(ARM))}
    bag = write_arm_bag(tmp_path / "a.mcap", free.times, topics)
    assert init(urdf, bag, "-o", tmp_path / "a.yaml") == 1
    said = capsys.readouterr().err
    assert told in said and "add <inertial>" not in said


def test_strange_names_are_matched_with_those_of_the_encoders(arm, free, tmp_path):
    """Neither topic has the URDF's names: one of them is taken in its order, the other by the names of the first."""
    strange = {"shoulder": "m1", "elbow": "m2", "wrist": "m3"}
    topics = {
        "/joint_states": free.states(("shoulder", "elbow", "wrist"), strange),
        "/motor_command": free.commands(("wrist", "elbow", "shoulder"), strange),
    }
    bag = write_arm_bag(tmp_path / "a.mcap", free.times, topics)
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 0
    robot = load_robot(tmp_path / "a.yaml")
    expected = tuple(strange[joint] for joint in robot.joints)
    assert robot.motor_encoder.source.names == expected
    assert robot.command.names == expected


@pytest.mark.parametrize("alone", [False, True], ids=["of all joints", "of the joint at rest"])
def test_joints_at_rest_do_not_move_by_a_second_node_that_publishes_zeros(arm, held, alone, tmp_path, capsys):
    zeros = held.states()
    zeros["position"] = np.zeros_like(zeros["position"])
    if alone:
        zeros |= {"names": ["wrist"], "position": zeros["position"][:, :1]}
    zeros |= {"rows": range(3, len(held.times), 3), "stamped": lambda stamp: stamp + 300_000}
    topics = {
        "/joint_states": held.states(),
        "/joint_states#zeros": zeros,
        "/motor_command": held.commands(("shoulder", "elbow")),
    }
    bag = write_arm_bag(tmp_path / "a.mcap", held.times, topics)
    assert init(arm, bag, "-o", tmp_path / "a.yaml") == 0
    assert "the recording can be used with it" in capsys.readouterr().out
    robot = load_robot(tmp_path / "a.yaml")
    assert robot.joints == ("shoulder", "elbow")
    assert robot.tree.locked == {"wrist": pytest.approx(-1.019, abs=1e-4)}
    recording = read_recording(bag, robot)
    assert recording.posture == {"wrist": pytest.approx(-1.019, abs=1e-4)}
    assert len(recording.streams["motor_encoder"].values) == len(held.times)
    said = [notice.text for notice in recording.notices if notice.kind == "foreign"]
    assert any(f"left out {len(range(3, len(held.times), 3))} messages" in text for text in said)
    reader = ArrivalReader(bag, robot)
    (block,) = list(reader)
    assert len(block) == recording.sample_count
    assert any(f"left out {len(range(3, len(held.times), 3))} messages" in text for text in reader.notices())
