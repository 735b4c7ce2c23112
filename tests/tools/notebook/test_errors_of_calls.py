# SPDX-License-Identifier: BSD-3-Clause
"""Functions and verbs refuse the same things with the same line, and no function ends the program."""

from __future__ import annotations

from pathlib import Path

import pytest
from fake_results import fake_recording, sinusoids

import jointscope as js
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import main
from jointscope.tools.notebook import calls


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A bag, a bag that is none, a robot file with a mistake, and limits with a mistake."""
    import numpy as np

    place = tmp_path_factory.mktemp("bad")
    robot, t = js.load_robot("doggy"), np.arange(0.0, 2.0, 0.01)
    write_bag(place / "good.mcap", fake_recording(robot, sinusoids(t, robot), t, np.random.default_rng(0)), robot)
    (place / "broken.mcap").write_bytes(b"no bag at all")
    (place / "odd.yaml").write_text("name: odd\njionts: []\n")
    (place / "limits.yaml").write_text("limits:\n  - {parameter: joint1.stiffness, at_mots: 3, because: bench}\n")
    return place


CASES = {
    "unknown robot": (["calibrate", "dogy", "good.mcap", "-o", "o.yaml"], lambda: js.calibrate("dogy", "good.mcap")),
    "mistake in a robot file": (["diagnose", "odd.yaml", "good.mcap"], lambda: js.diagnose("odd.yaml", "good.mcap")),
    "no file": (["discover", "doggy", "no.mcap", "-o", "o.yaml"], lambda: js.discover("doggy", "no.mcap")),
    "no bag": (["compare", "doggy", "broken.mcap"], lambda: js.compare("doggy", "broken.mcap")),
    "no such topic": (["compare", "hebi_5r", "good.mcap"], lambda: js.compare("hebi_5r", "good.mcap")),
    "other streams": (
        ["compare", "doggy", "kr300", "good.mcap"],
        lambda: js.compare(["doggy", "kr300"], "good.mcap"),
    ),
    "limits": (
        ["compare", "doggy", "good.mcap", "--accept", "limits.yaml"],
        lambda: js.compare("doggy", "good.mcap", accept="limits.yaml"),
    ),
    "unknown effect": (["add", "doggy", "clogging@joint1", "-o", "o.yaml"], lambda: js.add("doggy", "clogging@joint1")),
    "impossible owner": (["add", "doggy", "cogging@imu1", "-o", "o.yaml"], lambda: js.add("doggy", "cogging@imu1")),
    "not there to be removed": (
        ["remove", "doggy", "cogging@joint1", "-o", "o.yaml"],
        lambda: js.remove("doggy", "cogging@joint1"),
    ),
    "nothing to export": (["export", "doggy"], lambda: js.export("doggy")),
    "masses not known": (["export", "kr300", "--urdf", "o.urdf"], lambda: js.export("kr300", urdf="o.urdf")),
    "no bag to look at": (["info", "broken.mcap"], lambda: js.info("broken.mcap")),
    "not for the estimator": (["replay", "kr300", "good.mcap"], lambda: js.replay("kr300", "good.mcap")),
    "hidden effect": (
        ["simulate", "doggy", "-o", "o.mcap", "--effect", "x@y"],
        lambda: js.simulate("doggy", effects=["x@y"]),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_function_raises_the_line_that_the_command_line_prints(case, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    arguments, call = CASES[case]
    assert main(arguments) == 1
    said = capsys.readouterr().err
    with pytest.raises(js.JointscopeError) as raised:
        call()
    assert said == f"jointscope: error: {raised.value}\n"
    assert not Path("o.yaml").exists()


def test_nothing_given_is_told():
    with pytest.raises(js.errors.RecordingError, match=r"^no recording is given; expected a path"):
        js.calibrate("doggy", [])
    with pytest.raises(js.errors.RecordingError, match=r"from poses alone call calibrate_poses\(robot, \[read_poses"):
        js.calibrate("tx90l", [], poses=["poses.csv"])
    with pytest.raises(js.errors.RobotError, match=r"^no robot is given; expected one"):
        js.compare([], "good.mcap")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: js.graph("doggy"), "a graph belongs to a calibration: expected the result of calibrate, got str; "),
        (lambda: js.load_robot(5), "no robot '5': "),
        (lambda: js.add(3, "cogging@joint1"), "expected a robot, a result that has one, a name or a path, got int 3"),
        (lambda: js.calibrate("doggy", 7), "expected a recording, the result of simulate, or a path, got int 7"),
        (lambda: js.replay("doggy", None), "expected a recording, the result of simulate, or a path, got NoneType"),
    ],
)
def test_what_cannot_be_a_robot_or_a_recording_is_told(call, message):
    with pytest.raises(js.JointscopeError) as raised:
        call()
    assert str(raised.value).startswith(message)


def test_results_stand_for_their_robots_and_recordings(monkeypatch):
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    simulated, seen = js.simulate("doggy", seconds=1.0, effects="cogging@joint1", friction="smooth"), []
    assert simulated.answer().endswith("effects: cogging@joint1")

    class Reached(js.errors.SolveError):
        pass

    def begin(robots, recording, *args, **kwargs):
        seen.append((robots, recording))
        raise Reached("here it begins")

    monkeypatch.setattr(calls, "compare_motion", begin)
    with pytest.raises(Reached):
        js.compare("doggy", simulated)
    assert seen[0][1] is simulated.recording


@pytest.mark.parametrize("verb", ["calibrate", "compare", "diagnose", "discover"])
def test_verb_and_function_do_the_same_computation(verb, folder, monkeypatch, capsys):
    """With one stand-in for the computation, which both must reach."""

    class Reached(js.errors.SolveError):
        pass

    def begin(*args, **kwargs):
        raise Reached("here it begins")

    monkeypatch.chdir(folder)
    monkeypatch.setattr(calls, f"{verb}_motion", begin)
    with pytest.raises(Reached):
        getattr(js, verb)("doggy", "good.mcap")
    assert main([verb, "doggy", "good.mcap", *(["-o", "o.yaml"] if verb in ("calibrate", "discover") else [])]) == 1
    assert "here it begins" in capsys.readouterr().err


OTHER_TYPES = {
    "recording of another robot": (
        lambda recording: js.compare("biorob", recording),
        r"of another robot than biorob: its motor_encoder has joint1\.motor_position, .*; expected .*joint4",
    ),
    "limits that are none": (
        lambda recording: js.calibrate("doggy", recording, accept=[{}]),
        "accept: .* got dict",
    ),
    "no limits": (lambda recording: js.calibrate("doggy", recording, accept=None), "accept: .* got NoneType"),
    "stretches that are a number": (
        lambda recording: js.calibrate("doggy", recording, leave_out=5),
        r"leave_out: expected a list of \(t0, t1\) .*, got int 5",
    ),
    "times that are none": (
        lambda recording: js.diagnose("doggy", recording, leave_out=[("a", "b")]),
        r"leave_out: expected \(t0, t1\) \[s\] or 'BAG:T0:T1', got tuple",
    ),
    "a list of effects": (
        lambda recording: js.add("doggy", ["cogging@joint1"]),
        r"expected effects as .*, got \[",
    ),
    "an estimator by name": (lambda recording: js.FixedLagEstimator("doggy"), r"expected a Robot, as .*, got 'doggy'"),
    "a simulation without masses": (lambda recording: js.simulate("hebi_2r", seconds=2), "has link_dynamics: free"),
}


@pytest.mark.parametrize("case", OTHER_TYPES)
def test_what_is_of_another_type_is_said_in_one_line_before_any_work(case):
    import numpy as np

    robot, t = js.load_robot("doggy"), np.arange(0.0, 2.0, 0.01)
    recording = fake_recording(robot, sinusoids(t, robot), t, np.random.default_rng(0))
    call, said = OTHER_TYPES[case]
    with pytest.raises(js.JointscopeError, match=said) as raised:
        call(recording)
    assert "\n" not in str(raised.value)
