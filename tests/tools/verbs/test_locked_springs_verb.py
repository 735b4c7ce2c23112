# SPDX-License-Identifier: BSD-3-Clause
"""Recordings with locked springs on the command line: the matrix by itself, in the file, and what is refused."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from locked_bench import BIOROB, BIOROB_T, locked_bench

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import main

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data" / "biorob"
READY = Path(__file__).resolve().parents[3] / "robots" / "ready" / "biorob" / "biorob.yaml"
LOCKED = "locked_springs: {bench: [joint1, joint2, joint3, joint4]}\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A bench, an arm whose file lacks the idler, one whose file has no matrix at all, and one that names the bench."""
    found = tmp_path_factory.mktemp("locked")
    write_bag(found / "bench.mcap", locked_bench(BIOROB, 0), BIOROB)
    text = READY.read_text(encoding="utf-8").replace("urdf: biorob.urdf", "urdf: ready:biorob/biorob.urdf")
    (found / "idle.yaml").write_text(text.replace(", over: {joint3: 0.0120}", ""), encoding="utf-8")
    head, _, tail = text.partition("transmission:")
    (found / "bare.yaml").write_text(head + tail[tail.index("command:") :], encoding="utf-8")
    (found / "named.yaml").write_text(text + LOCKED, encoding="utf-8")
    return found


@pytest.fixture(autouse=True)
def here(folder, monkeypatch):
    monkeypatch.chdir(folder)


def complaint(capsys, *words):
    assert main(list(words)) == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1
    return said[0].removeprefix("jointscope: error: ")


@pytest.mark.parametrize("file", ["idle.yaml", "bare.yaml"])
def test_calibrate_writes_the_matrix_and_its_sigmas_into_the_file(file, capsys):
    words = ["calibrate", file, "--locked-springs", "bench.mcap", "-o", f"out_{file}", "--json", "out.json"]
    assert main([*words, "--report", "out.html"]) == 0
    said, content = capsys.readouterr().out, json.loads(Path("out.json").read_text())
    assert "write `transmission: {matrix: [[0.322" in said
    robot = load_robot(f"out_{file}")
    for (i, j), value in BIOROB_T.items():
        name = f"joint{i + 1}.from_joint{j + 1}"
        found = robot.parameters[name]
        assert found.value == pytest.approx(value, abs=3.5 * found.sigma) and found.sigma < 1e-4
        assert robot.transmission[i, j] == found.value
        assert content["parameters"][name]["sigma"] == pytest.approx(found.sigma, rel=0.01)
    assert np.count_nonzero(robot.transmission) == len(BIOROB_T)
    assert "joint4.from_joint3" in content["coupling"]["differs"]
    assert content["recordings"] == [{"kind": "locked_springs", "path": "bench.mcap", **found_in(content)}]
    assert "Which motors turn which links?" in Path("out.html").read_text()
    # the file that was written agrees with the bench
    assert main(["info", "bench.mcap", "--robot", f"out_{file}", "--locked-springs"]) == 0
    assert "The transmission of the robot file is the one that the locked springs show." in capsys.readouterr().out


def found_in(content):
    return {key: content["recordings"][0][key] for key in ("sha256", "count")}


def test_info_names_a_missing_coupling_and_the_matrix_to_paste(capsys):
    words = ["info", "bench.mcap", "--robot", "idle.yaml", "--locked-springs", "--json", "info.json"]
    assert main(words) == 0
    content = json.loads(Path("info.json").read_text())
    assert content["usable"] and content["coupling"]["differs"] == ["joint4.from_joint3"]
    said = capsys.readouterr().out
    assert "the transmission of idle.yaml is not that of its locked springs: joint4.from_joint3 is -0.189" in said
    assert "11 further elements of the inverse are zero within 4 sigma" in said


def test_info_knows_a_recording_that_the_robot_file_names(capsys):
    assert main(["info", "bench.mcap", "--robot", "named.yaml"]) == 0
    assert "Locked springs in bench.mcap (joint1, joint2, joint3, joint4)" in capsys.readouterr().out


@pytest.mark.parametrize("words", [["named.yaml", "bench.mcap"], ["named.yaml", "--rests", "bench.mcap"]])
def test_a_recording_with_locked_springs_is_no_motion_and_no_rest(words, capsys):
    told = "bench.mcap: locked_springs of named.yaml says that springs were locked there, so it is no recording of the"
    assert complaint(capsys, "calibrate", *words, "-o", "no.yaml").startswith(told)
    assert not Path("no.yaml").exists()


def test_a_name_of_digits_alone_is_a_name(capsys):
    text = Path("named.yaml").read_text(encoding="utf-8").replace("{bench:", "{2024:")
    Path("numbered.yaml").write_text(text, encoding="utf-8")
    shutil.copy("bench.mcap", "2024.mcap")
    assert main(["info", "2024.mcap", "--robot", "numbered.yaml"]) == 0
    assert "Locked springs in 2024.mcap (joint1, joint2, joint3, joint4)" in capsys.readouterr().out


def test_without_the_file_s_word_what_springs_do_not_do_tells(capsys):
    write_bag(Path("other.mcap"), locked_bench(BIOROB, 2), BIOROB)
    assert main(["info", "other.mcap", "--robot", "biorob"]) == 0
    said = capsys.readouterr().out
    assert "note: springs do not deflect: joint1 (motor and link agree within 0.001" in said
    assert "if they were locked, this is no recording of motion: jointscope calibrate biorob --locked-springs" in said


@pytest.mark.parametrize(
    ("section", "told"),
    [
        ("[joint1, joint9]", "bad.yaml: locked_springs: no joint 'joint9'; did you mean 'joint4'?"),
        (
            "joint1",
            "bad.yaml: locked_springs: expected a list of joints, or one for each recording ({bench: [joint1]})",
        ),
        ("{bench: [elbow]}", "bad.yaml: locked_springs.bench: no joint 'elbow'; expected joint1, joint2"),
        ("{bench: [joint1, joint1]}", "bad.yaml: locked_springs.bench: joint1 stands there twice; write it once"),
        ("{late: [joint1]}", "bad.yaml: locked_springs names late, but not bench; add `bench: [JOINT, ...]`"),
    ],
)
def test_mistakes_in_the_section_are_named(section, told, capsys):
    text = Path("named.yaml").read_text(encoding="utf-8").replace(LOCKED, f"locked_springs: {section}\n")
    Path("bad.yaml").write_text(text, encoding="utf-8")
    words = ("calibrate", "bad.yaml", "--locked-springs", "bench.mcap", "-o", "no.yaml")
    assert complaint(capsys, *words).startswith(told)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            ["doggy", "--locked-springs", "bench.mcap"],
            "bench.mcap: with locked springs motors and links are compared, and doggy.yaml has no sensor of kind link_",
        ),
        (
            ["biorob", "bench.mcap", "--locked-springs", "bench.mcap"],
            "bench.mcap is given as motion and as locked",
        ),
        (["biorob", "--locked-springs", "none.mcap"], "the bag none.mcap does not exist"),
        (
            ["biorob", "--locked-springs", "bench.mcap", "--poses", "p.csv"],
            "--locked-springs goes alone, with",
        ),
        (
            ["biorob", "--locked-springs", "bench.mcap", "--rrd", "a.rrd"],
            "biorob: --rrd shows motion, not locked",
        ),
        (["tx90l", "--locked-springs", "bench.mcap"], "tx90l.yaml has no `command` and no `sensors`"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(words, told, capsys):
    assert complaint(capsys, "calibrate", *words, "-o", "no.yaml").startswith(told)
    assert not Path("no.yaml").exists()


def turned(recording, **factors):
    streams = {
        name: replace(stream, values=stream.values * factors.get(name, 1.0))
        for name, stream in recording.streams.items()
    }
    return replace(recording, streams=streams)


@pytest.mark.parametrize(
    ("file", "encoders"),
    [
        ("biorob", ("link_encoder",)),
        ("biorob", ("motor_encoder",)),  # without a matrix in the file it might be a gear of 57
        ("bare.yaml", ("link_encoder",)),
        ("bare.yaml", ("motor_encoder", "link_encoder")),
    ],
)
def test_degrees_are_no_matrix(file, encoders, capsys):
    degrees = turned(locked_bench(BIOROB, 3), **dict.fromkeys(encoders, 180.0 / np.pi))
    write_bag(Path("degrees.mcap"), replace(degrees, path="degrees"), BIOROB)
    said = complaint(capsys, "calibrate", file, "--locked-springs", "degrees.mcap", "-o", "no.yaml")
    told = f"look like degrees: set `unit` of sensors.{encoders[-1]} in the robot file (now rad) to deg"
    assert said.startswith("degrees.mcap: joint") and said.endswith(told)
    assert not Path("no.yaml").exists()


def test_a_spring_that_is_not_locked_is_told_by_how_much(capsys):
    write_bag(Path("soft.mcap"), replace(locked_bench(BIOROB, 1, give=0.3), path="soft"), BIOROB)
    said = complaint(capsys, "calibrate", "biorob", "--locked-springs", "soft.mcap", "-o", "no.yaml")
    assert said.startswith("soft.mcap: the spring of joint1 is said to be locked, but deflects by 0.")


def test_the_page_says_what_its_commands_print(tmp_path, monkeypatch, capsys):
    page = (Path(__file__).resolve().parents[3] / "docs" / "locked_springs.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"<!-- executed by \S+ -->\n```bash\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    text = READY.read_text(encoding="utf-8").replace("urdf: biorob.urdf", "urdf: ready:biorob/biorob.urdf")
    Path("arm.yaml").write_text(text.replace(", over: {joint3: 0.0120}", ""), encoding="utf-8")
    write_bag(Path("bench"), locked_bench(BIOROB, 0), BIOROB)
    for command in block.splitlines():
        assert main(shlex.split(command)[1:]) == 0
    assert Path("arm_coupled.yaml").is_file()
    printed = page.partition("```\nLocked springs in")[2].partition("write `transmission")[0]
    assert len(printed.splitlines()) == 9 and printed in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(not SHARED.is_dir(), reason="shared/data/biorob is not beside the project")
def test_rests_and_locked_springs_share_the_elements_in_one_graph(capsys):
    words = ["calibrate", "bare.yaml", "--rests", str(SHARED / "static_gravity" / "gravity")]
    assert main([*words, "--locked-springs", "bench.mcap", "-o", "both.yaml", "--json", "both.json"]) == 0
    together = json.loads(Path("both.json").read_text())
    alone = together["coupling"]["sigmas"]
    for (i, j), value in BIOROB_T.items():
        found = together["parameters"][f"joint{i + 1}.from_joint{j + 1}"]
        assert found["value"] == pytest.approx(value, abs=3.5 * found["sigma"])
        assert found["sigma"] < alone[i][j]  # rests tell something, too
    assert {r["kind"] for r in together["recordings"]} == {"rests", "locked_springs"}
