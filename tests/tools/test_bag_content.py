# SPDX-License-Identifier: BSD-3-Clause
"""Bags that can be opened but hold something else than expected, message by message."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.messages.message_type import known_message_type
from jointscope.tools.bags.needed_streams import needed_streams
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

JOINTS = ("joint1", "joint2", "joint3")
ENCODER = "/joint_states"
SECOND = 1_000_000_000
MILLISECOND = 1_000_000
COUNT = 300


@pytest.fixture(scope="module")
def doggy():
    return load_robot("doggy")


@dataclasses.dataclass
class JointMessage:
    """A JointState to be written: stamp [ns], names, positions."""

    stamp: int
    names: tuple[str, ...]
    position: tuple[float, ...]
    frame: str = ""


def joint_messages(names=JOINTS, count=COUNT):
    return [
        JointMessage(SECOND + k * MILLISECOND, names, tuple(100.0 * j + k for j in range(len(names))))
        for k in range(count)
    ]


def write_with(path, robot, messages, msgtype="sensor_msgs/msg/JointState", garbage=()):
    """A bag with ordinary command and gyros, and with the given messages on the encoder's topic."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    ros2 = path.suffix != ".bag"
    kind = known_message_type(msgtype, ros2)
    writer = Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP) if ros2 else Writer1(path)
    imu, joint = (known_message_type(f"sensor_msgs/msg/{name}", ros2) for name in ("Imu", "JointState"))
    with writer:
        for need in needed_streams(robot):
            if need.name == "motor_encoder":
                continue
            other = joint if need.name == "command" else imu
            connection = writer.add_connection(need.source.topic, other.name, typestore=other.typestore)
            for k in range(COUNT):
                stamp = SECOND + k * MILLISECOND
                command = JointMessage(stamp, JOINTS, ())
                raw = (
                    joint_state(joint, command, effort=(0.1, 0.2, 0.3 + k))
                    if other is joint
                    else imu_bytes(imu, stamp, k)
                )
                writer.write(connection, stamp, raw)
        connection = writer.add_connection(ENCODER, kind.name, typestore=kind.typestore)
        for k, message in enumerate(messages):
            raw = joint_state(kind, message) if kind.name == joint.name else imu_bytes(imu, message.stamp, k)
            writer.write(connection, SECOND + k * MILLISECOND, raw[: len(raw) // 2] if k in garbage else raw)


def header(kind, stamp, frame=""):
    types = kind.typestore.types
    time = types["builtin_interfaces/msg/Time"](sec=stamp // SECOND, nanosec=stamp % SECOND)
    rest = {} if kind.ros2 else {"seq": 7}
    return types["std_msgs/msg/Header"](stamp=time, frame_id=frame, **rest)


def joint_state(kind, message, effort=()):
    return kind.encode(
        kind.typestore.types[kind.name](
            header=header(kind, message.stamp, message.frame),
            name=list(message.names),
            position=np.array(message.position, dtype=float),
            velocity=np.empty(0),
            effort=np.array(effort, dtype=float),
        )
    )


def imu_bytes(kind, stamp, k):
    types, zeros = kind.typestore.types, np.zeros(9)
    vector = types["geometry_msgs/msg/Vector3"]
    return kind.encode(
        types[kind.name](
            header=header(kind, stamp),
            orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=zeros,
            angular_velocity=vector(x=0.1 * k, y=1.0, z=-k * 1.0),
            angular_velocity_covariance=zeros,
            linear_acceleration=vector(x=0.0, y=0.0, z=9.81),
            linear_acceleration_covariance=zeros,
        )
    )


def error_of(path, robot):
    with pytest.raises(RecordingError) as error:
        read_recording(path, robot)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.fixture(params=("run", "run.bag"))
def path(request, tmp_path):
    return tmp_path / request.param


def test_joints_in_another_order_are_put_into_the_robots_order(doggy, path):
    write_with(path, doggy, joint_messages(("joint3", "joint1", "joint2")))
    stream = read_recording(path, doggy).streams["motor_encoder"]
    assert stream.channels == ("joint1.motor_position", "joint2.motor_position", "joint3.motor_position")
    assert stream.values[0].tolist() == [100.0, 200.0, 0.0]


def test_more_joints_than_the_robot_has_are_ignored_and_noted(doggy, path):
    write_with(path, doggy, joint_messages(("joint1", "gripper", "joint2", "joint3")))
    recording = read_recording(path, doggy)
    assert recording.streams["motor_encoder"].values[0].tolist() == [0.0, 200.0, 300.0]
    assert [n.text for n in recording.notices if n.kind == "info"] == [
        "motor_encoder: joints of the bag that the robot does not have are ignored: gripper"
    ]


def test_messages_without_joint_names_are_taken_in_the_robots_order(doggy, path):
    messages = [dataclasses.replace(message, names=(), position=(1.0, 2.0, 3.0)) for message in joint_messages()]
    write_with(path, doggy, messages)
    recording = read_recording(path, doggy)
    assert recording.streams["motor_encoder"].values[0].tolist() == [1.0, 2.0, 3.0]
    assert [n.text for n in recording.notices if n.kind == "info"] == [
        "motor_encoder: the messages name no joints; the order of the robot file is assumed"
    ]


def test_unknown_joint_names_are_listed(doggy, path):
    write_with(path, doggy, joint_messages(("a1", "a2", "a3")))
    assert error_of(path, doggy) == (
        "topic /joint_states, field 'position': no joint 'joint1' in the messages, which name a1, a2, a3; "
        "set `names` of motor_encoder in the robot file"
    )


def test_a_joint_name_that_stands_twice_is_refused(doggy, path):
    write_with(path, doggy, joint_messages(("joint1", "joint2", "joint3", "joint1")))
    assert error_of(path, doggy) == "topic /joint_states, field 'position': the joint name 'joint1' stands 2 times"


def test_a_message_in_another_order_is_read_by_its_names(doggy, path):
    messages = joint_messages()
    messages[17].names = ("joint2", "joint1", "joint3")
    messages[17].position = (117.0, 17.0, 217.0)
    write_with(path, doggy, messages)
    recording = read_recording(path, doggy)
    assert recording.streams["motor_encoder"].values[17].tolist() == [17.0, 117.0, 217.0]
    assert recording.notices == []


def test_messages_that_do_not_fit_are_left_out_and_counted_by_what_they_are(doggy, path):
    messages = joint_messages()
    messages[5].position = (1.0,)
    messages[6].position = ()
    for k in (50, 51, 52):
        messages[k].names, messages[k].position = ("finger",), (0.3,)
    write_with(path, doggy, messages, garbage=(9,))
    recording = read_recording(path, doggy)
    stream = recording.streams["motor_encoder"]
    assert np.delete(np.arange(COUNT), [5, 6, 9, 50, 51, 52]).tolist() == stream.values[:, 0].tolist()
    assert [n.text for n in recording.notices if n.kind == "foreign"] == [
        "motor_encoder: left out 3 messages of other joints (finger), 1 message without values, "
        "1 message with 1 value for 3 names, 1 message that cannot be decoded"
    ]


def test_joints_that_come_and_go_do_not_matter(doggy, path):
    messages = joint_messages()
    for k in range(0, COUNT, 3):
        messages[k].names = ("gripper", *JOINTS)
        messages[k].position = (9.0, *messages[k].position)
    write_with(path, doggy, messages)
    stream = read_recording(path, doggy).streams["motor_encoder"]
    assert stream.values[:, 0].tolist() == list(range(COUNT))


def test_joints_that_two_nodes_publish_are_read_each_at_its_own_stamps(doggy, path):
    messages = joint_messages()
    for k, message in enumerate(messages):
        part = slice(0, 2) if k % 3 else slice(2, 3)
        message.names, message.position = message.names[part], message.position[part]
    write_with(path, doggy, messages)
    stream = read_recording(path, doggy).streams["motor_encoder"]
    told = np.array([[k % 3 > 0] * 2 + [k % 3 == 0] for k in range(COUNT)])
    np.testing.assert_array_equal(np.isfinite(stream.measured), told)
    expected = np.array([[k, 100.0 + k, 200.0 + k] for k in range(COUNT)])
    np.testing.assert_array_equal(stream.measured[told], expected[told])


def test_a_field_that_is_always_empty_is_refused(doggy, path):
    messages = [dataclasses.replace(message, position=()) for message in joint_messages()]
    write_with(path, doggy, messages)
    assert error_of(path, doggy) == (
        "topic /joint_states, field 'position': 0 values for 3 joint names (joint1, joint2, joint3)"
    )


def test_where_many_messages_cannot_be_decoded_the_first_is_named(doggy, path):
    write_with(path, doggy, joint_messages(), garbage=range(9, 20))
    assert error_of(path, doggy).startswith("topic /joint_states, message 9: its ")
    assert error_of(path, doggy).endswith(" bytes are not a sensor_msgs/msg/JointState; the bag is damaged")


def test_a_changing_frame_leads_to_the_same_numbers(doggy, path):
    messages = joint_messages()
    write_with(path, doggy, messages)
    expected = read_recording(path, doggy).streams["motor_encoder"]
    messages[40].frame = "another"
    other = path.with_name("other" + path.suffix)
    write_with(other, doggy, messages)
    assert read_recording(other, doggy).streams["motor_encoder"].values.tobytes() == expected.values.tobytes()


def test_a_topic_of_the_wrong_type_is_refused(doggy, path):
    write_with(path, doggy, joint_messages(), msgtype="sensor_msgs/msg/Imu")
    assert error_of(path, doggy) == (
        f"{path}: topic /joint_states holds sensor_msgs/msg/Imu; the robot file expects sensor_msgs/msg/JointState"
    )


def test_an_empty_topic_is_refused(doggy, path):
    write_with(path, doggy, [])
    assert error_of(path, doggy) == (
        f"{path}: topic /joint_states is empty: it holds no message; check that its driver ran while recording"
    )


def test_a_missing_topic_is_refused_with_the_nearest_name(doggy, path):
    write_with(path, doggy, joint_messages())
    source = dataclasses.replace(doggy.motor_encoder.source, topic="/joint_state")
    robot = doggy.with_sensors({"motor_encoder": dataclasses.replace(doggy.motor_encoder, source=source)})
    assert error_of(path, robot) == (
        f"{path}: topic /joint_state is missing; record it, or change `topic` in the robot file; "
        "did you mean '/joint_states'?"
    )


def test_a_missing_field_is_refused_with_those_there_are(doggy, path):
    write_with(path, doggy, joint_messages())
    source = dataclasses.replace(doggy.gyros[0].source, field="angular_velocity.w")
    robot = doggy.with_sensors({"imu1": dataclasses.replace(doggy.gyros[0], source=source)})
    assert error_of(path, robot) == (
        "topic /imu1/data_raw: sensor_msgs/msg/Imu has no field 'angular_velocity.w': no 'w'; it has x, y, z; "
        "set `field` in the robot file"
    )


def test_a_text_is_not_a_number(doggy, path):
    write_with(path, doggy, joint_messages())
    source = dataclasses.replace(doggy.gyros[0].source, field="header.frame_id")
    robot = doggy.with_sensors({"imu1": dataclasses.replace(doggy.gyros[0], source=source)})
    assert error_of(path, robot) == "topic /imu1/data_raw, message 0: the field 'header.frame_id' holds no numbers"


def test_a_gyro_needs_three_values(doggy, path):
    write_with(path, doggy, joint_messages())
    source = dataclasses.replace(doggy.gyros[0].source, field="orientation")
    robot = doggy.with_sensors({"imu1": dataclasses.replace(doggy.gyros[0], source=source)})
    assert error_of(path, robot) == (
        "topic /imu1/data_raw, field 'orientation': imu1 expects 3 values (imu1.x, imu1.y, imu1.z), got 4"
    )


@pytest.mark.parametrize(
    ("stamp", "told"),
    [(0, "all its stamps are zero"), (1_700_000_000_000_000_000, "all its stamps are 1700000000.000 s")],
)
def test_stamps_that_nobody_fills_are_replaced_by_times_of_reception(doggy, path, stamp, told):
    stamped = path.with_stem("stamped")
    write_with(stamped, doggy, joint_messages())
    expected = read_recording(stamped, doggy).streams["motor_encoder"]
    write_with(path, doggy, [dataclasses.replace(message, stamp=stamp) for message in joint_messages()])
    recording = read_recording(path, doggy)
    found = recording.streams["motor_encoder"]
    assert f"motor_encoder: {told}; the time of reception stands in for it" in "".join(
        n.text for n in recording.notices
    )
    np.testing.assert_array_equal(found.values, expected.values)
    steps = np.diff(found.times) - np.diff(expected.times)
    assert np.abs(steps).max() < 1e-3


def test_stamps_far_in_the_epoch_keep_their_nanoseconds(doggy, tmp_path):
    times = np.array([0, 1, 3, 1_000_000_007]) / 1e9
    streams = {
        need.name: Stream(need.name, times, np.zeros((4, 3)), need.channels, "") for need in needed_streams(doggy)
    }
    start = 1_999_999_999_999_999_999
    write_bag(tmp_path / "run.mcap", Recording("", "", start, streams), doggy)
    recording = read_recording(tmp_path / "run.mcap", doggy)
    assert recording.start_ns == start
    assert np.rint(recording.command.times * 1e9).astype(int).tolist() == [0, 1, 3, 1_000_000_007]
