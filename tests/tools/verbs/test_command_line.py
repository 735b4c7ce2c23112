# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import errno
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fake_results import fake_calibration, fake_comparison

import jointscope
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.command_words import ready_robots
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags import read_motion as read_module
from jointscope.tools.bags.needed_streams import needed_streams
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import main, verbs
from jointscope.tools.notebook import calls
from jointscope.tools.verdicts.judgement import judge

IMPORT_COST = {"numpy", "gtsam", "pinocchio", "rerun", "rosbags", "scipy", "mujoco"}


@pytest.fixture(autouse=True)
def in_own_folder(tmp_path, monkeypatch):
    """Every command runs in an empty folder, so that whatever it leaves behind shows."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("JOINTSCOPE_TRACEBACK", raising=False)


@pytest.fixture
def no_solving(monkeypatch):
    """Reading, calibrating and comparing give made-up results at once."""
    monkeypatch.setattr(read_module, "read_motion", lambda path, robot, progress=None: fake_comparison().recording)
    monkeypatch.setattr(calls, "calibrate_motion", lambda *args, **options: fake_calibration())
    monkeypatch.setattr(calls, "compare_motion", lambda *args, progress: fake_comparison())


def files(folder=".") -> set[str]:
    return {path.name for path in Path(folder).iterdir()}


def complaint(capsys, *arguments: str) -> str:
    """What a failing command says: one line on standard error, exit code 1, no traceback."""
    assert main(arguments) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("jointscope: error: ")
    assert err.count("\n") == 1
    return err.removeprefix("jointscope: error: ").rstrip("\n")


def raising(error: BaseException):
    def function(*args, **kwargs):
        raise error

    return function


def jointscope_process(*arguments: str, **options) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "jointscope.tools.command_line", *arguments]
    return subprocess.run(command, text=True, stderr=subprocess.PIPE, timeout=60, **options)


# usage


def test_help_lists_every_verb_with_a_sentence(capsys):
    with pytest.raises(SystemExit) as exit_:
        main(["--help"])
    text = capsys.readouterr().out
    assert exit_.value.code == 0
    assert {"calibrate", "compare", "demo", "info", "robots", "simulate"} <= set(verbs())
    for name, summary in verbs().items():
        assert name in text
        assert len(summary) > 20


@pytest.mark.parametrize("verb", sorted(verbs()))
def test_the_help_of_every_verb_has_an_example_of_itself(verb, capsys):
    with pytest.raises(SystemExit) as exit_:
        main([verb, "--help"])
    text = capsys.readouterr().out
    assert exit_.value.code == 0
    assert f"jointscope {verb}" in text.partition("example")[2]


READ_ROBOT_FILES = "add calibrate closed-loop compare diagnose discover info remove replay report simulate".split()


@pytest.mark.parametrize("verb", READ_ROBOT_FILES)
def test_every_verb_that_reads_robot_files_takes_effects_of_the_users_own(verb, capsys):
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    assert "--effects FILE.py" in capsys.readouterr().out


def test_version(capsys):
    with pytest.raises(SystemExit) as exit_:
        main(["--version"])
    assert exit_.value.code == 0
    assert capsys.readouterr().out == f"jointscope {jointscope.__version__}\n"


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["calibarte"],
        ["calibrate"],
        ["calibrate", "doggy"],
        ["calibrate", "doggy", "a.mcap"],
        ["calibrate", "doggy", "a.mcap", "-o", "b.yaml", "--colour"],
        ["compare", "a.mcap"],
        ["demo", "--seconds", "long"],
        ["effects", "--effect", "backlash@joint3"],  # no abbreviation of --effects
    ],
)
def test_wrong_usage_exits_with_2(arguments, capsys):
    with pytest.raises(SystemExit) as exit_:
        main(arguments)
    assert exit_.value.code == 2
    said = capsys.readouterr().err
    assert "usage: jointscope" in said and said.count("\n") == 1


def test_an_unknown_option_is_told_with_the_help_of_its_verb(capsys):
    with pytest.raises(SystemExit):
        main(["calibrate", "doggy", "train.mcap", "-o", "out.yaml", "--foo"])
    told = "jointscope: error: unrecognized arguments: --foo; usage: jointscope calibrate --help\n"
    assert capsys.readouterr().err == told


def test_help_imports_nothing_heavy():
    program = (
        "import sys\nfrom jointscope.tools.command_line import main\n"
        f"try:\n    main(['--help'])\nfinally:\n    assert not {IMPORT_COST!r} & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


# bad input

ROBOT_MISTAKES = {
    "format: 1": ("format: 1\nbanana: 1", "my.yaml: unknown key 'banana'; expected calibration, command, constants, "),
    "coriolis: true": ("coriolis: 3", "my.yaml: model.coriolis: expected true or false, got 3"),
    "value: 400.0": ("value: -400.0", "my.yaml: parameters.joint1.stiffness.value: expected a number above zero, got "),
}


@pytest.mark.parametrize("right", ROBOT_MISTAKES)
@pytest.mark.parametrize("verb", ["calibrate", "compare", "info"])
def test_a_wrong_robot_file_is_one_line(right, verb, capsys):
    wrong, told = ROBOT_MISTAKES[right]
    text = ready_robots()["doggy"].read_text().replace("urdf: doggy.urdf", "urdf: ready:doggy/doggy.urdf")
    Path("my.yaml").write_text(text.replace(right, wrong, 1))
    arguments = {
        "calibrate": ["calibrate", "my.yaml", "a.mcap", "-o", "out.yaml"],
        "compare": ["compare", "my.yaml", "a.mcap"],
        "info": ["info", "a.mcap", "--robot", "my.yaml"],
    }
    assert complaint(capsys, *arguments[verb]).startswith(told)
    assert files() == {"my.yaml"}


def test_an_impossible_inertia_is_one_line(capsys):
    folder = ready_robots()["doggy"].parent
    urdf = (folder / "doggy.urdf").read_text().replace('izz="0.4702376"', 'izz="-2.0"')
    Path("doggy.urdf").write_text(urdf)
    Path("my.yaml").write_text((folder / "doggy.yaml").read_text())
    text = complaint(capsys, "calibrate", "my.yaml", "a.mcap", "-o", "out.yaml")
    assert text.startswith(
        "doggy.urdf: link link1, moved by joint1, has a negative inertia: principal moments -2, 2, 2 "
    )
    assert "the mass matrix is not positive definite, so joint1 has no equation of motion" in text


def test_an_unknown_robot_is_one_line(capsys):
    told = "no robot 'dogy': neither a file nor a ready robot; did you mean 'doggy'?"
    assert complaint(capsys, "calibrate", "dogy", "a.mcap", "-o", "out.yaml") == told
    assert complaint(capsys, "robots", "dogy") == "no ready robot 'dogy'; did you mean 'doggy'?"


@pytest.mark.parametrize(
    "arguments",
    [["calibrate", "doggy", "a.mcap", "-o", "out.yaml"], ["compare", "doggy", "a.mcap"], ["info", "a.mcap"]],
    ids=["calibrate", "compare", "info"],
)
def test_a_missing_or_corrupt_bag_is_one_line_that_names_it(arguments, capsys):
    assert "a.mcap" in complaint(capsys, *arguments)
    Path("a.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(range(200)))
    assert "a.mcap" in complaint(capsys, *arguments)
    assert files() == {"a.mcap"}


def test_bag_and_robot_in_the_wrong_order_are_told_apart(capsys):
    Path("a.mcap").write_bytes(b"\x89MCAP0\r\n")
    told = "a.mcap is not a robot file: it is not text; a robot comes first, then the bag"
    assert complaint(capsys, "calibrate", "a.mcap", "doggy", "-o", "out.yaml") == told


def test_values_that_are_not_finite_are_one_line_and_nothing_is_written(capsys):
    robot, rng, times = load_robot("doggy"), np.random.default_rng(1), np.arange(1000) / 1e3
    streams = {
        need.name: Stream(need.name, times, rng.uniform(-1, 1, (1000, 3)), need.channels, "")
        for need in needed_streams(robot)
    }
    streams["imu1"].values[:600, 0] = np.nan
    write_bag("a.mcap", Recording("", "", 10**18, streams), robot)
    text = complaint(capsys, "calibrate", "doggy", "a.mcap", "-o", "out.yaml", "--report", "r.html")
    assert "imu1.x is no number (NaN or infinite) in 600 of 1000 messages (60 %), the first at 0.000 s" in text
    assert files() == {"a.mcap"}


def test_comparing_a_robot_with_itself_is_one_line(capsys):
    told = "the robot doggy is named twice; name each model once"
    assert complaint(capsys, "compare", "doggy", "doggy", "a.mcap") == told


# outputs

BAD_OUTPUTS = [
    (["-o", "no/out.yaml"], "cannot write no/out.yaml: the folder no does not exist; create it first"),
    (
        ["-o", "o", "--report", "no/r.html"],
        "cannot write no/r.html: the folder no does not exist; create it first",
    ),
    (["-o", "o.yaml", "--rrd", "folder"], "cannot write folder: it is a folder; expected the name of a file"),
    (["-o", "o.yaml", "--json", "o.yaml"], "cannot write o.yaml: it is named for two outputs; give it another name"),
    (["-o", "a.mcap"], "cannot write a.mcap: it is also an input; give it another name"),
]


@pytest.mark.parametrize(("outputs", "told"), BAD_OUTPUTS, ids=[told[:50] for _, told in BAD_OUTPUTS])
def test_outputs_are_checked_before_anything_is_computed(outputs, told, capsys, monkeypatch):
    monkeypatch.setattr(read_module, "read_motion", raising(AssertionError("too early")))
    Path("folder").mkdir()
    assert complaint(capsys, "calibrate", "doggy", "a.mcap", *outputs) == told


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission_is_one_line(capsys):
    Path("locked").mkdir(mode=0o500)
    told = "cannot write locked/o.yaml: Permission denied"
    assert complaint(capsys, "calibrate", "doggy", "a.mcap", "-o", "locked/o.yaml") == told


ALL = ["-o", "o.yaml", "--report", "r.html", "--rrd", "f.rrd", "--json", "c.json"]


def test_calibrate_says_what_it_found_and_writes_every_file(no_solving, capsys):
    assert main(["calibrate", "doggy", "a.mcap", *ALL]) == 0
    text = capsys.readouterr().out
    for part in (
        judge(fake_calibration()).headline,
        "joint1.stiffness",
        "scale together",
        "imu2.z",
        "Wrote o.yaml, r.html",
    ):
        assert part in text
    doubtful = judge(fake_calibration()).level != "good"
    assert ("jointscope diagnose o.yaml 'runs/train <1>.mcap' --report diagnosis.html" in text) is doubtful is True
    assert files() == {"o.yaml", "r.html", "f.rrd", "c.json"}
    content = json.loads(Path("c.json").read_text())
    assert content["converged"] is True
    again = load_robot("o.yaml")
    value = content["parameters"]["joint1.stiffness"]["value"]
    assert again.parameter("joint1.stiffness").value == pytest.approx(value, rel=1e-6)
    assert again.document["calibration"]["version"] == jointscope.__version__
    assert again.document["calibration"]["bags"][0]["path"] == "runs/train <1>.mcap"


def test_compare_shows_the_models_side_by_side(no_solving, capsys):
    assert main(["compare", "doggy", "doggy_paper", "a.mcap", "--report", "r.html", "--json", "c.json"]) == 0
    text = capsys.readouterr().out
    for part in (
        "error  floor  unexplained",
        "open loop",
        "joint3.motor_position",
        "is worst:",
        "Wrote r.html, c.json",
    ):
        assert part in text
    assert files() == {"r.html", "c.json"}
    assert len(json.loads(Path("c.json").read_text())["models"]) == 2


def test_report_is_compare_for_the_browser(no_solving, capsys):
    assert main(["report", "doggy", "a.mcap", "-o", "r.html"]) == 0
    assert files() == {"r.html"}


@pytest.mark.parametrize("where", ["calibrate", "report", "rrd", "json"])
def test_ctrl_c_leaves_nothing_behind(where, no_solving, capsys, monkeypatch):
    from jointscope.tools import report, rerun_log
    from jointscope.tools.verb_parts import result_files

    Path("o.yaml").write_text("before")
    place = {
        "calibrate": (calls, "calibrate_motion"),
        "report": (report, "calibration_report"),
        "rrd": (rerun_log, "log_calibration"),
        "json": (result_files, "write_json"),
    }[where]
    monkeypatch.setattr(*place, raising(KeyboardInterrupt()))
    assert complaint(capsys, "calibrate", "doggy", "a.mcap", *ALL) == "interrupted; nothing was written"
    assert files() == {"o.yaml"}
    assert Path("o.yaml").read_text() == "before"


@pytest.mark.parametrize("where", ["write_text", "replace"])
def test_a_full_disk_is_one_line_and_leaves_nothing_behind(where, no_solving, capsys, monkeypatch):
    Path("o.yaml").write_text("before")
    owner = Path if where == "write_text" else os
    monkeypatch.setattr(owner, where, raising(OSError(errno.ENOSPC, "No space left on device")))
    text = complaint(capsys, "calibrate", "doggy", "a.mcap", "-o", "o.yaml", "--report", "r.html")
    monkeypatch.undo()
    assert text.startswith("cannot write ")
    assert text.endswith(": No space left on device")
    assert ".part" not in text


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_output_that_cannot_be_printed_is_one_line():
    with open("/dev/full", "w") as full:
        done = jointscope_process("robots", stdout=full)
    assert done.returncode == 1
    assert done.stderr == "jointscope: error: No space left on device\n"


def test_a_reader_that_has_seen_enough_is_no_trouble():
    read, write = os.pipe()
    os.close(read)
    done = jointscope_process("robots", "doggy", stdout=write)
    os.close(write)
    assert (done.returncode, done.stderr) == (1, "")


def test_a_bug_is_one_line_too_and_can_be_looked_into(no_solving, capsys, monkeypatch):
    monkeypatch.setattr(calls, "calibrate_motion", raising(ZeroDivisionError("division\nby zero")))
    arguments = ["calibrate", "doggy", "a.mcap", "-o", "o.yaml"]
    told = "this is a bug in jointscope: ZeroDivisionError: division by zero; JOINTSCOPE_TRACEBACK=1 shows where"
    assert complaint(capsys, *arguments) == told
    monkeypatch.setenv("JOINTSCOPE_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        main(arguments)


def test_robots_lists_and_prints_files_that_work_elsewhere(capsys):
    assert main(["robots", "--json", "robots.json"]) == 0
    assert re.search("doggy_paper +Doggy with the literal choices", capsys.readouterr().out)
    assert set(json.loads(Path("robots.json").read_text())["robots"]) == set(ready_robots())
    assert main(["robots", "doggy"]) == 0
    Path("mine.yaml").write_text(capsys.readouterr().out)
    assert load_robot("mine.yaml").name == "doggy"


def test_a_missing_urdf_and_files_in_the_wrong_order_are_said_with_the_command(capsys):
    Path("arm.urdf").write_text("<robot/>")
    Path("a.mcap").write_bytes(b"\x89MCAP0\r\n")
    Path("arm.yaml").write_text("name: arm")
    for told, arguments in (
        ("there is no URDF arn.urdf; did you mean 'arm.urdf'?", ("init", "arn.urdf", "a.mcap", "-o", "x.yaml")),
        (
            "a.mcap is no URDF; the URDF comes first: jointscope init arm.urdf a.mcap -o x.yaml",
            ("init", "a.mcap", "arm.urdf", "-o", "x.yaml"),
        ),
        (
            "arm.yaml is a robot file and no recording; the recording comes first: "
            "jointscope info a.mcap --robot arm.yaml",
            ("info", "arm.yaml", "--robot", "a.mcap"),
        ),
    ):
        assert complaint(capsys, *arguments) == told
    assert files() == {"arm.urdf", "a.mcap", "arm.yaml"}


def test_files_that_no_other_order_would_mend_are_not_told_to_change_places(capsys):
    for name in ("arm.urdf", "arm2.urdf"):
        Path(name).write_text("<robot/>")
    Path("a.mcap").write_bytes(b"\x89MCAP0\r\n")
    Path("bag").mkdir()
    Path("bag/metadata.yaml").write_text("rosbag2_bagfile_information: {}")
    Path("arm.yaml").write_text("name: arm")
    for arguments in (
        ("init", "arm.urdf", "arm2.urdf", "-o", "x.yaml"),
        ("init", "a.mcap", "a.mcap", "-o", "x.yaml"),
        ("info", "bag/metadata.yaml"),
        ("info", "arm.yaml"),
    ):
        assert "comes first" not in complaint(capsys, *arguments), arguments
    told = "arm.yaml is a robot file and no recording; the recording comes first: jointscope info bag --robot arm.yaml"
    assert complaint(capsys, "info", "arm.yaml", "--robot", "bag") == told
