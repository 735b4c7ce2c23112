# SPDX-License-Identifier: BSD-3-Clause
"""Several targets and orientations as they come in: rows of tables, poses and transforms of bags."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tools_with_targets import tool_with

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.rotations import quaternion_xyzw
from jointscope.tools.bags.at_poses.pose_table import pose_table
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
MOCAP = (
    "left: {at: [0.08, 0.0, 0.03], positions: {topic: /mocap, type: geometry_msgs/msg/TransformStamped, "
    "field: transform.translation, unit: m, names: [left]}}, right: {positions: {topic: /right, "
    "type: geometry_msgs/msg/PoseStamped, field: pose.position, unit: m}}"
)


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return tool_with(tmp_path_factory.mktemp("tool"))


@pytest.fixture(scope="module")
def poses(robot):
    """Eight poses; the right target is hidden in one, the left one has no orientation in another."""
    found, _ = simulate_poses(robot, 8, 3, PoseConditions(orientation=True))
    left, right = found.others
    right.place[2], right.turn[2], left.turn[5] = np.nan, np.nan, np.nan
    return found


def same(read, poses, atol):
    assert read.names == poses.names and [s.name for s in read.others] == ["left", "right"]
    np.testing.assert_allclose(read.q, poses.q, atol=atol)
    pairs = zip((read, *read.others), (poses, *poses.others), strict=True)
    for one, other in pairs:
        places = (s.target if s in (read, poses) else s.place for s in (one, other))
        np.testing.assert_allclose(*places, atol=atol)
        np.testing.assert_allclose(one.turn, other.turn, atol=atol)


def test_a_table_gives_back_what_was_written_also_with_its_rows_in_another_order(tmp_path, robot, poses):
    head, *rows = pose_table(poses, robot).splitlines()
    assert len(rows) == 23 and head.endswith(",target,x,y,z,qx,qy,qz,qw")
    (tmp_path / "poses.csv").write_text("\n".join([head, *rows]))
    same(read_poses(tmp_path / "poses.csv", robot), poses, 1e-7)
    first = [row for row in rows if ",reflector," in row]
    others = [row for row in rows if ",reflector," not in row]
    empty = [row.replace(",reflector,", ",,") for row in first]
    (tmp_path / "poses.csv").write_text("\n".join([head, *empty, *others[::-1]]))
    same(read_poses(tmp_path / "poses.csv", robot), poses, 1e-7)


def test_a_table_of_one_target_is_as_ever_whatever_its_column_says(tmp_path, robot, poses):
    one = replace(poses, others=(), turn=None)
    text = pose_table(one, robot)
    (tmp_path / "plain.csv").write_text(text)
    head, *rows = text.splitlines()
    named = [head + ",target", *(row + ",prism" for row in rows)]
    (tmp_path / "named.csv").write_text("\n".join(named))
    plain, tx90l = read_poses(tmp_path / "plain.csv", robot), load_robot("tx90l")
    for read in (plain, read_poses(tmp_path / "named.csv", tx90l)):
        np.testing.assert_array_equal(read.target, plain.target)
        assert read.names == one.names and read.turn is None and not read.others


def changed(text, line, column, value):
    rows = [row.split(",") for row in text.splitlines()]
    rows[line - 1][rows[0].index(column)] = value
    return "\n".join(",".join(row) for row in rows)


def without(text, column):
    rows = [row.split(",") for row in text.splitlines()]
    i = rows[0].index(column)
    return "\n".join(",".join(cells[:i] + cells[i + 1 :]) for cells in rows)


def all_of(text, columns, value):
    rows = [row.split(",") for row in text.splitlines()]
    for row in rows[1:]:
        for column, cell in zip(columns, value, strict=True):
            row[rows[0].index(column)] = cell
    return "\n".join(",".join(row) for row in rows)


WRONG = {
    "the targets top are none of tool.yaml, which has reflector, left, right; name them in its section poses, as "
    "`targets: {top: {}}`": lambda text: changed(text, 3, "target", "top"),
    "pose 0 has 2 rows of the target reflector; expected one row for each pose and target": lambda text: changed(
        text, 3, "target", "reflector"
    ),
    "line 3: pose 0 has other angles in line 2, by 0.": lambda text: changed(text, 3, "joint1", "0.1"),
    "a row for each target needs a column `pose`": lambda text: without(text, "pose"),
    "no column 'qz'; expected all of qx, qy, qz, qw, or none of them": lambda text: without(text, "qz"),
    "line 4: expected four numbers in qx, qy, qz, qw, or none where no orientation was measured, got ": (
        lambda text: changed(text, 4, "qy", "")
    ),
    "line 2: the quaternion of reflector has norm ": lambda text: changed(text, 2, "qw", "1.5"),
}


@pytest.mark.parametrize("told", WRONG)
def test_rows_that_cannot_be_are_one_line(tmp_path, robot, poses, told):
    (tmp_path / "poses.csv").write_text(WRONG[told](pose_table(poses, robot)))
    with pytest.raises(RecordingError) as err:
        read_poses(tmp_path / "poses.csv", robot)
    assert told in str(err.value) and "\n" not in str(err.value)


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (("0", "0", "0", "1"), "the orientation of left is the identity in all poses, as if the tracker gave none"),
        (("0.5", "0.5", "0.5", "0.5"), "the orientation of left is the same in all poses, as if the tracker gave none"),
        (("0", "0", "0", "0"), "the tracker gives no orientation of left (all are zero); none is used"),
    ],
)
def test_a_tracker_that_gives_no_orientation_is_told_and_not_used(tmp_path, robot, poses, value, told):
    (tmp_path / "poses.csv").write_text(all_of(pose_table(poses, robot), ("qx", "qy", "qz", "qw"), value))
    read = read_poses(tmp_path / "poses.csv", robot)
    assert read.turn is None and all(other.turn is None for other in read.others)
    assert any(told in notice.text for notice in read.notices)


def test_two_targets_that_the_robot_file_does_not_know_are_told(tmp_path, robot, poses):
    (tmp_path / "poses.csv").write_text(pose_table(poses, robot))
    with pytest.raises(RecordingError, match=r"the targets left, right are none of tx90l.yaml, which has reflector;"):
        read_poses(tmp_path / "poses.csv", load_robot("tx90l"))


def write_bag(path, robot, poses, hidden=()):
    """Rests of a second; one target on a topic of points, one among transforms of two, one on a topic of poses."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    t = store.types
    Time, Header, Point, Vector, Quaternion = (
        t["builtin_interfaces/msg/Time"], t["std_msgs/msg/Header"], t["geometry_msgs/msg/Point"],
        t["geometry_msgs/msg/Vector3"], t["geometry_msgs/msg/Quaternion"],
    )  # fmt: skip
    empty = np.zeros(0)
    left, right = poses.others
    rng = np.random.default_rng(0)

    def turned(R):
        sign = rng.choice([-1.0, 1.0])  # q and -q are one orientation
        return Quaternion(*(sign * quaternion_xyzw(R) if np.isfinite(R[0, 0]) else np.zeros(4)))

    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        kinds = {
            "/joint_states": "sensor_msgs/msg/JointState",
            "/tracker/point": "geometry_msgs/msg/PointStamped",
            "/mocap": "geometry_msgs/msg/TransformStamped",
            "/right": "geometry_msgs/msg/PoseStamped",
        }
        connections = {k: writer.add_connection(k, v, typestore=store) for k, v in kinds.items() if k not in hidden}

        def write(topic, stamp, *parts):
            if topic in connections:
                header = Header(Time(stamp // 10**9, stamp % 10**9), "tracker")
                message = t[kinds[topic]](header, *parts)
                writer.write(connections[topic], stamp, store.serialize_cdr(message, kinds[topic]))

        for i in range(len(poses)):
            for k in range(50):
                stamp = 10**18 + int((i * 2.0 + k * 0.02) * 1e9)
                write("/joint_states", stamp, list(robot.joints), poses.q[i], empty, empty)
                write("/tracker/point", stamp, Point(*poses.target[i]))
                transform = t["geometry_msgs/msg/Transform"]
                write("/mocap", stamp, "left", transform(Vector(*left.place[i]), turned(left.turn[i])))
                write("/mocap", stamp + 1000, "wrist", transform(Vector(1.0, 2.0, 3.0), Quaternion(0.0, 0.0, 0.0, 1.0)))
                if np.isfinite(right.place[i, 0]):
                    pose = t["geometry_msgs/msg/Pose"](Point(*right.place[i]), turned(right.turn[i]))
                    write("/right", stamp, pose)
    return path


def test_a_bag_tells_of_all_targets_and_orientations(tmp_path, poses):
    robot = tool_with(tmp_path, MOCAP)
    read = read_poses(write_bag(tmp_path / "bag", robot, poses), robot)
    same(replace(read, turn=poses.turn), poses, 1e-9)
    assert read.turn is None  # a topic of points has none


def test_a_bag_without_the_topic_of_one_target_says_so(tmp_path, poses):
    robot = tool_with(tmp_path, MOCAP)
    read = read_poses(write_bag(tmp_path / "bag", robot, poses, ["/right"]), robot)
    assert [other.name for other in read.others] == ["left"]
    assert any("has no topic /right: the target right was not seen" in notice.text for notice in read.notices)


def test_a_topic_of_several_targets_needs_a_name(tmp_path, poses):
    robot = tool_with(tmp_path, MOCAP.replace(", names: [left]", ""))
    with pytest.raises(
        RecordingError, match=r"tells of several targets .*name the one of poses.targets.left.positions"
    ):
        read_poses(write_bag(tmp_path / "bag", robot, poses), robot)
