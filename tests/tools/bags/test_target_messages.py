# SPDX-License-Identifier: BSD-3-Clause
"""A tracker that tells of two markers on one topic, by `child_frame_id`, and two trackers on one topic."""

import copy

import numpy as np
import pytest
from changed_bag import changed_bag

from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.command_words import ready_robots
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

MARKER = """
  marker:
    kind: position_target
    topic: /mocap
    type: geometry_msgs/msg/TransformStamped
    field: transform.translation
    unit: mm
    target: link2
    at: [0.2, 0.0, 0.3]
    tracker: base
    sigma: 0.0005

parameters:"""


def written(folder, names=""):
    """The robot of a file; `names` is a line of its marker."""
    text = ready_robots()["doggy"].read_text().replace("urdf: doggy.urdf", "urdf: ready:doggy/doggy.urdf")
    text = text[: text.index("  imu1:")] + text[text.index("\nparameters:") :]
    text = text.replace("\nparameters:", MARKER, 1).replace("topic: /mocap", f"topic: /mocap{names}")
    (folder / "my.yaml").write_text(text)
    return load_robot(folder / "my.yaml")


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """A bag of one second with one marker, and its recording."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    folder = tmp_path_factory.mktemp("plain")
    robot = written(folder)
    write_bag(folder / "run.mcap", simulate(robot, "calibration", 1.0, seed=1).recording, robot)
    return folder / "run.mcap", read_recording(folder / "run.mcap", robot).streams["marker"]


@pytest.fixture(scope="module")
def woven(plain, tmp_path_factory):
    """The same, with a second marker that is always told of first."""

    def beside_another(topic, message, k):
        if topic != "/mocap":
            return [(topic, message)]
        message.header.frame_id, message.child_frame_id = "world", "elbow"
        other = copy.deepcopy(message)
        other.child_frame_id = "shoulder"
        other.transform.translation.x += 700.0
        return [(topic, other), (topic, message)]

    return changed_bag(plain[0], tmp_path_factory.mktemp("bag") / "woven", beside_another)


def test_a_topic_with_two_markers_is_told_with_what_to_write(woven, tmp_path):
    with pytest.raises(RecordingError) as err:
        read_recording(woven, written(tmp_path))
    assert str(err.value) == (
        "topic /mocap tells of several targets (child_frame_id shoulder 200 times, elbow 200 times); name the one of "
        "sensors.marker in the robot file, for example `names: [shoulder]`"
    )


def test_the_marker_that_is_named_is_read_also_in_a_replay(plain, woven, tmp_path):
    robot = written(tmp_path, "\n    names: [elbow]")
    read = read_recording(woven, robot).streams["marker"]
    np.testing.assert_array_equal(read.values, plain[1].values)
    np.testing.assert_array_equal(read.times, plain[1].times)
    messages = [m for block in ArrivalReader(woven, robot, block=50) for m in block if m[1] == "marker"]
    np.testing.assert_array_equal(np.array([value for *_, value in messages]), plain[1].values)


def test_the_name_stays_in_the_robot_file(tmp_path):
    robot = written(tmp_path, "\n    names: [elbow]")
    (tmp_path / "again.yaml").write_text(robot_text(robot, tmp_path))
    assert load_robot(tmp_path / "again.yaml").sensors["marker"].source.names == ("elbow",)


def test_names_that_cannot_be_are_told(woven, tmp_path):
    with pytest.raises(
        RecordingError, match=r"no message has the child_frame_id 'ellbow' of sensors.marker.names; did"
    ):
        read_recording(woven, written(tmp_path, "\n    names: [ellbow]"))
    with pytest.raises(RobotError, match="expected one name, the child_frame_id of this target, got 2"):
        written(tmp_path, "\n    names: [elbow, shoulder]")


def test_positions_in_the_axes_of_two_trackers_are_told(plain, tmp_path):
    def of_two_cameras(topic, message, k):
        if topic == "/mocap":
            message.header.frame_id = "left" if k % 2 else "right"
        return [(topic, message)]

    with pytest.raises(RecordingError) as err:
        read_recording(changed_bag(plain[0], tmp_path / "two", of_two_cameras), written(tmp_path))
    assert "the positions of marker are in the axes of several trackers (header.frame_id " in str(err.value)
    assert str(err.value).endswith("give each a topic and a sensor of its own, or transform the positions")
