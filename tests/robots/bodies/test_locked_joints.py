# SPDX-License-Identifier: BSD-3-Clause
"""Joints that are not the robot's: where its file holds them, where a recording shows them, and what is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from robots_to_compare import MIMICKING

from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.command_words import ready_robots
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.recordings.screening import about_bodies

JOINTS = "joints: [joint1, joint2, joint3]"


@pytest.fixture
def written(tmp_path):
    """Writes Doggy's file with the bodies that follow, and lines after those of the joints."""

    def write(lines, joints=JOINTS):
        text = ready_robots()["doggy"].read_text().replace("urdf: doggy.urdf", f"urdf: {MIMICKING}")
        assert JOINTS in text
        path = tmp_path / "my.yaml"
        path.write_text(text.replace(JOINTS, f"{joints}\n{lines}"))
        return path

    return write


def recording_of(robot, posture):
    """A second at rest."""
    times = np.arange(1000) / 1e3
    streams = {"command": Stream("command", times, np.zeros((1000, robot.n)), tuple("abc"), "1")}
    for name, sensor in robot.sensors.items():
        values = np.zeros((1000, len(sensor.channels)))
        streams[name] = Stream(name, times, values, sensor.channels, sensor.units[0])
    return Recording("", "", 0, streams, posture=posture)


def test_a_robot_file_locks_other_joints(written):
    robot = load_robot(written("locked: {ear: 0.7}   # bent forward"))
    assert robot.tree.locked == {"ear": 0.7}
    q = np.array([[0.3, 0.2, 0.1]])
    assert np.abs(robot.tree.torque(q, q, q) - load_robot(written("")).tree.torque(q, q, q)).max() > 1e-3


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("locked: {ears: 0.7}", "my.yaml: locked: mimicking_doggy.urdf has no joint 'ears' that can be locked; it has "
         "ear, wave"),
        ("locked: {joint2: 0.7}", "my.yaml: locked: joint2 is one of the robot's joints, which move; remove it from "
         "one of the two"),
        ("locked: {knee: 0.7}", "my.yaml: locked: knee is a mimic joint of mimicking_doggy.urdf and follows joint3: "
         "which is one of the robot's joints; remove knee"),
        ("locked: {ear: up}", "my.yaml: locked.ear: expected a finite number, got 'up'"),
        ("locked: {ear: .inf}", "my.yaml: locked.ear: expected a finite number, got inf"),
        ("locked: [ear]", "my.yaml: locked: expected a mapping, got ['ear']"),
        ("locked: {ear: 90}", "my.yaml: locked: ear at 90 rad is far outside of the limits -2 to 2 rad of "
         "mimicking_doggy.urdf; expected radians: 1.571 if it is 90 degrees"),
    ],
)  # fmt: skip
def test_mistakes_among_locked_joints_are_named(written, lines, told):
    with pytest.raises(RobotError) as error:
        load_robot(written(lines))
    assert str(error.value) == told


def test_joints_may_be_listed_in_any_order(written):
    q = np.array([[0.3, 0.2, 0.1]])
    M = load_robot(written("")).tree.mass_matrix(q)[0]
    turned = load_robot(written("", "joints: [joint3, joint1, joint2]"))
    np.testing.assert_allclose(turned.tree.mass_matrix(q[:, [2, 0, 1]])[0], M[np.ix_([2, 0, 1], [2, 0, 1])], rtol=1e-12)


def test_a_written_file_holds_what_is_locked_and_its_comments(written, tmp_path):
    robot = load_robot(written("locked: {ear: 0.7}   # bent forward"))
    text = robot_text(robot.locked_as_in({"ear": 0.2}), tmp_path)
    assert "locked: {ear: 0.7}   # bent forward" in text  # what the file says stays
    # another joint may come, and files without the line get one
    text = robot_text(load_robot(written("")).locked_as_in({"ear": 0.25, "wave": 1.0, "joint1": 3.0}), tmp_path)
    (tmp_path / "my.yaml").write_text(text)
    assert load_robot(tmp_path / "my.yaml").tree.locked == {"ear": 0.25}
    for line in ready_robots()["doggy"].read_text().splitlines():
        comment = line.partition("#")[2].strip()
        assert comment in text
    untouched = robot_text(load_robot(written("")), tmp_path)
    assert "locked" not in untouched


def test_a_posture_changes_the_bodies_and_not_what_is_written(written, tmp_path):
    robot = load_robot(written("locked: {ear: 0.7}"))
    posed = robot.in_posture({"ear": -0.4, "wave": 1.0, "joint1": 0.3, "someone_elses": 2.0})
    assert posed.tree.locked == {"ear": -0.4}
    assert posed.in_posture({"ear": -0.4}) is posed
    assert posed.in_posture({}).tree is robot.tree  # what one recording shows is not carried into the next
    assert "locked: {ear: 0.7}" in robot_text(posed.with_values({"motor.k_pwm": 3.0}), tmp_path)
    q = np.array([[0.3, 0.2, 0.1]])
    direct = load_robot(written("locked: {ear: -0.4}"))
    np.testing.assert_array_equal(posed.kinematic_tree.mass_matrix(q), direct.kinematic_tree.mass_matrix(q))


def test_every_recording_is_computed_in_its_own_posture(written):
    robot = load_robot(written("locked: {ear: 0.7}"))
    problems = [BagProblem.of(robot, recording_of(robot, posture)) for posture in ({"ear": -0.4}, {}, {"ear": 1.0})]
    assert [problem.robot.tree.locked["ear"] for problem in problems] == [-0.4, 0.7, 1.0]
    # as does a piece of one that is built from the robot of another
    again = BagProblem.of(problems[0].robot, problems[1].recording.between(0.0, 0.5))
    assert again.robot.tree.locked == {"ear": 0.7}


def test_where_joints_are_held_is_said_once_and_only_if_it_is_news(written):
    robot, filed = load_robot(written("")), load_robot(written("locked: {ear: 0.7}"))
    recording = recording_of(robot, {"ear": 0.70001, "wave": 0.2})
    (notice,) = about_bodies(recording, robot)
    assert (notice.kind, notice.count) == ("info", 1)
    assert notice.text == "ear is not moved: held at 0.7 rad as in the recording"
    assert about_bodies(recording, filed) == []
    (notice,) = about_bodies(replace(recording, posture={"ear": -0.5}), filed)
    assert notice.text == (
        "ear is not moved: held at -0.5 rad as in the recording (the robot file locks ear at 0.7 rad)"
    )
