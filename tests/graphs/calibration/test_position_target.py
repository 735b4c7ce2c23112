# SPDX-License-Identifier: BSD-3-Clause
"""Two targets on a simulated Doggy without gyroscopes, seen by one camera; MuJoCo says where they are."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.comparison.compare import compare_model
from jointscope.graphs.fixed_lag.replay.replay import replay
from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.command_words import ready_robots
from jointscope.robots.recordings.screening import screen

TRUE = {"marker3.tracker_x": 0.03, "marker3.tracker_turn_z": 0.08, "marker3.offset_x": 0.006}
SIGMA = 5e-4  # [m]
SENSORS = """
  marker3:
    kind: position_target
    topic: /camera/marker3
    type: geometry_msgs/msg/PointStamped
    field: point
    unit: m
    target: link3
    at: [0.0, 0.1, 0.9]
    tracker_pose: [[0, -1, 0, 2.0], [0, 0, -1, 0.5], [1, 0, 0, 1.0], [0, 0, 0, 1]]
    sigma: 0.0005
  marker2:
    kind: position_target
    topic: /camera/marker2
    type: geometry_msgs/msg/TransformStamped
    field: transform.translation
    unit: mm
    target: link2
    at: [0.2, 0.0, 0.3]
    tracker: marker3
    sigma: 0.0005

parameters:"""
UNKNOWN = {"tracker": ("m", 0.05), "tracker_turn": ("rad", 0.1), "offset": ("m", 0.01)}


def written(folder, old="", new=""):
    """The robot of a file."""
    text = ready_robots()["doggy"].read_text().replace("urdf: doggy.urdf", "urdf: ready:doggy/doggy.urdf")
    own = [
        f"  marker3.{name}_{axis}: {{value: 0.0, unit: {unit}, positive: false, prior_sigma: {sigma}}}\n"
        for name, (unit, sigma) in UNKNOWN.items()
        for axis in "xyz"
    ]
    text = text[: text.index("  imu1:")] + text[text.index("\nparameters:") :]
    text = text.replace("\nparameters:", SENSORS, 1).replace("\nnoise:", "".join(own) + "\nnoise:", 1)
    assert old in text
    (folder / "my.yaml").write_text(text.replace(old, new, 1))
    return load_robot(folder / "my.yaml")


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return written(tmp_path_factory.mktemp("robot"))


@pytest.fixture(scope="module")
def made(robot, tmp_path_factory):
    """Three seconds of motion, read back from a bag."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.bags.read_recording import read_recording
    from jointscope.tools.bags.write_bag import write_bag
    from jointscope.tools.simulator import simulate

    run = simulate(robot, "calibration", 3.0, seed=3, friction="smooth", parameters=TRUE, jitter=2e-4)
    path = tmp_path_factory.mktemp("bag") / "run.mcap"
    write_bag(path, run.recording, robot)
    return replace(run, recording=read_recording(path, robot))


@pytest.fixture(scope="module")
def result(robot, made):
    return calibrate(robot, [made.recording])


def test_values_tracker_and_target_are_within_their_sigmas_of_the_truth(result, made):
    truth = made.truth["parameters"]
    assert truth["marker3.tracker_x"] == 0.03
    found = {name: p for name, p in result.robot.parameters.items() if not p.fixed}
    away = {name: (p.value - truth[name]) / p.sigma for name, p in found.items()}
    assert max(map(abs, away.values())) < 4.0, away
    assert all(found[f"marker3.{name}_{axis}"].sigma < 1e-3 for name in UNKNOWN for axis in "xyz")  # [m], [rad]


def test_its_channels_are_no_more_than_noise(result):
    for name in ("marker2", "marker3"):
        assert all(0.8 < result.channels[f"{name}.{axis}"].chi2 < 1.2 for axis in "xyz")


def test_springs_are_known_much_better_with_it(result, robot, made):
    alone = calibrate(robot.without(robot.targets), [made.recording]).robot.parameters
    shares = {name: result.robot.parameters[name].sigma / p.sigma for name, p in alone.items() if not p.fixed}
    assert all(share < 1.001 for share in shares.values()), shares
    assert all(shares[f"joint{k}.stiffness"] < 0.7 for k in (1, 2, 3)), shares  # 0.62, 0.56, 0.43


@pytest.mark.parametrize("shift", [0.02, 0.04, 0.05, -0.03])
def test_the_delay_of_a_camera_is_told_and_found(robot, made, shift):
    stream = made.recording.streams["marker3"]
    late = replace(stream, times=stream.times + shift, received=None)
    recording = replace(made.recording, streams={**made.recording.streams, "marker3": late})
    if shift > 0.03:  # springs so soft look like 20 ms themselves, which hide as much of a clock that is ahead
        (told,) = (n.text for n in screen(recording, robot) if n.kind == "timing")
        about = float(told.split("marker3 is late, by about ")[1].split(" ms, some of which may be due to springs")[0])
        assert about == pytest.approx(1e3 * shift, abs=25.0)
        assert "encoder_delay@marker3" in told and not [n for n in screen(made.recording, robot) if n.kind == "timing"]
    knowing = add_effect(robot, "encoder_delay@marker3")
    assert not [n for n in screen(recording, knowing) if n.kind == "timing"]
    found = calibrate(knowing, [recording]).robot.parameters
    delay = found["marker3.encoder_delay.delay"]
    assert abs(delay.value - shift) < 4.0 * delay.sigma < 4e-4
    assert found["joint2.stiffness"].value == pytest.approx(made.truth["parameters"]["joint2.stiffness"], rel=5e-3)


def test_a_left_handed_tracker_is_told_and_read(robot, made, tmp_path):
    stream = made.recording.streams["marker3"]
    mirrored = replace(stream, values=stream.values * (1.0, -1.0, 1.0))
    alone = robot.without([target for target in robot.targets if target.name == "marker2"])
    with pytest.raises(RecordingError, match="only a mirror image of its positions fits the motion of link3") as err:
        screen(_with_marker(made.recording, mirrored), alone)
    assert "set `left_handed: true` of sensors.marker3" in str(err.value)
    pose = str(err.value).split("tracker_pose: ")[1].split(", or mend")[0]
    before = "[[0, -1, 0, 2.0], [0, 0, -1, 0.5], [1, 0, 0, 1.0], [0, 0, 0, 1]]"
    known = written(tmp_path, before, f"{pose}\n    left_handed: true")
    scale = known.sensors["marker3"].source.scale
    assert scale == (-1.0, 1.0, 1.0)
    read = _with_marker(made.recording, replace(mirrored, values=mirrored.values * scale))
    assert not [n for n in screen(read, known.without(known.targets[1:])) if "marker3" in n.text]


def _with_marker(recording, stream):
    return replace(recording, streams={**recording.streams, "marker3": stream})


def test_what_was_found_stands_in_the_robot_file(result, tmp_path):
    (tmp_path / "out.yaml").write_text(robot_text(result.robot, tmp_path))
    again, found = load_robot(tmp_path / "out.yaml"), result.robot.parameters
    assert again.parameters["marker3.tracker_x"].value == pytest.approx(found["marker3.tracker_x"].value)
    assert again.sensors["marker2"].tracker == "marker3"
    np.testing.assert_array_equal(again.sensors["marker2"].tracker_pose, again.sensors["marker3"].tracker_pose)


def test_the_estimator_takes_it_and_stays_consistent(result, made):
    found = replay(result.robot, made.recording)
    assert found.dropped == 0
    for name in ("marker2", "marker3"):
        assert 0.8 < found.innovations[name].nis_mean < 1.25


def test_predictions_have_errors_near_their_floors(result, made):
    comparison = compare_model("calibrated", result.robot, made.recording)
    for channel in ("marker3.x", "marker3.y", "marker3.z", "marker2.x"):
        assert comparison.channels[channel].horizons["0.01"] < 2.0 * comparison.floors[channel] * SIGMA


def screened(robot, made, change=lambda values, times: values):
    stream = made.recording.streams["marker3"]
    streams = {**made.recording.streams, "marker3": replace(stream, values=change(stream.values, stream.times))}
    return [n.text for n in screen(replace(made.recording, streams=streams), robot) if n.stream == "marker3"]


def test_a_sound_recording_is_nothing_to_speak_of(robot, made):
    assert screened(robot, made) == []


def test_millimetres_are_said(robot, made):
    with pytest.raises(RecordingError, match=r"look like millimetres: set `unit` of sensors.marker3 .*now m\) to mm"):
        screened(robot, made, lambda values, times: 1e3 * values)


def test_a_wrong_link_is_said_with_the_right_one(robot, made):
    wrong = robot.with_sensors({"marker3": replace(robot.sensors["marker3"], body="link2")})
    with pytest.raises(
        RecordingError, match=r"does not move as a point of link2: .* `target` of sensors.marker3 to link3"
    ):
        screened(wrong, made)


def test_a_tracker_that_moves_is_said(robot, made):
    def carried(values, times):
        return values + np.column_stack([np.sin(5.0 * times), 0.5 * times, np.cos(2.0 * times)])

    with pytest.raises(RecordingError, match="no other link fits: the tracker moved while it measured"):
        screened(robot, made, carried)


def test_a_tracker_that_was_put_elsewhere_is_said_with_its_place(robot, made):
    (text,) = screened(robot, made, lambda values, times: values + np.array([0.0, 1.0, 0.0]))
    assert "its tracker may stand elsewhere: with sensors.marker3.tracker_pose: [[" in text


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("    tracker: marker3\n", "", "my.yaml: sensors.marker2: the frame of the marker is unknown;"),
        ("tracker: marker3", "tracker: vicon", "my.yaml: sensors.marker2.tracker: the frame 'vicon' is unknown: "),
        ("tracker: marker3", "tracker: link1", "my.yaml: sensors.marker2.tracker: link1 moves with the arm"),
        ("target: link2", "target: link9", "my.yaml: sensors.marker2.target: no link 'link9'; did you mean 'link3'?"),
        ("target: link2", "target: base", "my.yaml: sensors.marker2.target: no joint moves base"),
        ("unit: mm", "unit: rad", "my.yaml: sensors.marker2.unit: a position is in m or mm, got 'rad'"),
        ("[1, 0, 0, 1.0]", "[1, 1, 0, 1.0]", "my.yaml: sensors.marker3.tracker_pose: not a rotation matrix"),
        ("[0, 0, 0, 1]]", "[0, 0, 0, 2]]", "my.yaml: sensors.marker3.tracker_pose: expected a last row"),
        ("offset_x: {value: 0.0, unit: m", "offset_x: {value: 0.0, unit: rad", "my.yaml: parameters.marker3.offset_x"),
    ],
)  # fmt: skip
def test_bad_input_is_told_in_one_line(old, new, told, tmp_path):
    with pytest.raises(RobotError) as error:
        written(tmp_path, old, new)
    assert str(error.value).startswith(told) and "\n" not in str(error.value)


def test_a_link_of_the_base_may_say_where_the_tracker_stands(tmp_path):
    robot = written(tmp_path, "tracker: marker3", "tracker: base")
    np.testing.assert_array_equal(robot.sensors["marker2"].tracker_pose, np.eye(4))
    assert robot.sensors["marker2"].place[0] == "marker2.tracker_x"
