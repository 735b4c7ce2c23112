# SPDX-License-Identifier: BSD-3-Clause
"""`frequency`: what it reads, writes, says and refuses."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from periodic_systems import RATE, recorded, true_response, two_by_two

from jointscope.tools.bags.write_bag import joint_states, write_topics
from jointscope.tools.command_line import main

TX90L = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "tx90l" / "frequency"
LINES = np.arange(3, 100, 2)
DESCRIPTION = """f0: 0.5
sample_time: 0.005
lines: {lines}
experiments:
{rows}
"""
ROW = "  - {{bag: {bag}, realisation: {r}, experiment: {e}, sign: {s}, start: {start}, periods: {p}, transient: 0}}\n"


def write(folder, name="run", **change):
    """A bag of two realisations, and what excited it."""
    signals, excitation = recorded(two_by_two, LINES, 2, realisations=2, sigma=1e-4)
    u = change.get("u", lambda values: values)(signals.inputs.values)
    stamps = np.rint(signals.inputs.times * 1e9).astype(np.int64) + 1_700_000_000_000_000_000
    fields = {"effort": u, "position": signals.outputs.values}
    write_topics(folder / name, [joint_states("/joint_states", ("a", "b"), stamps, fields)])
    return excitation


def describe(folder, excitation, bag="run", **change):
    rows = "".join(
        ROW.format(bag=bag, r=e.realisation, e=e.number, s=e.sign, start=e.start, p=e.periods)
        for e in excitation.experiments
    )
    text = DESCRIPTION.format(lines=list(map(int, excitation.lines)), rows=rows)
    for old, new in change.items():
        text = text.replace(f"{old}: ", f"{old}: {new}  # ")
    (folder / "excitation.yaml").write_text(text)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("frequency")
    files = {"-o": "f.npz", "--report": "f.html", "--json": "f.json"}
    write(folder)
    options = [text for option, name in files.items() for text in (option, str(folder / name))]
    assert main(["frequency", str(folder / "run"), *options]) == 0
    return folder


def test_matrix_report_and_json_are_written(made):
    arrays = np.load(made / "f.npz")
    np.testing.assert_array_equal(arrays["frequency_hz"], 0.5 * LINES)
    np.testing.assert_allclose(arrays["response"], true_response(0.5 * LINES), rtol=0.1, atol=1e-4)
    assert arrays["total_covariance"].shape == arrays["noise_covariance"].shape == (len(LINES), 4, 4)
    page = (made / "f.html").read_text()
    assert "two sigmas, total" in page and "Resonances" in page and "even lines" in page
    (content,) = json.loads((made / "f.json").read_text())["responses"]
    assert content["excitation"]["source"] == "the recording" and content["excitation"]["realisations"] == 2
    assert content["inputs"] == ["a", "b"] and np.shape(content["total"]) == (2, 2)


def test_a_description_beside_the_bag_says_the_same_as_the_recording(made, tmp_path, capsys):
    again = write(tmp_path)
    describe(tmp_path, again)
    assert main(["frequency", str(tmp_path / "run"), "-o", str(tmp_path / "f.csv")]) == 0
    assert "excitation.yaml" in capsys.readouterr().out
    with (tmp_path / "f.csv").open() as file:
        rows = list(csv.DictReader(file))
    G = np.array([complex(float(r["real"]), float(r["imag"])) for r in rows]).reshape(len(LINES), 2, 2)
    np.testing.assert_allclose(G, np.load(made / "f.npz")["response"], rtol=1e-6, atol=1e-9)
    assert {float(r["sigma_total"]) > 0.0 for r in rows} == {True}


def test_signals_are_named_by_topic_field_and_names(made, capsys):
    arguments = [
        "frequency",
        str(made / "run"),
        "--from",
        "/joint_states:effort:a,b",
        "--to",
        "/joint_states:position:b",
    ]
    assert main(arguments) == 0
    rows = [line.split()[:2] for line in capsys.readouterr().out.splitlines() if "%" in line]
    assert rows == [["a", "b"], ["b", "b"]]


REFUSED = {
    "another bag": (dict(bag="other"), "no experiment of the bag 'run'; it describes other: give the file of this bag"),
    "another rate": (dict(sample_time="0.001"), "sample_time 0.001 s, but "),
    "above half the rate": (dict(lines="[3, 401]"), "line 401 is at 200.5 Hz, above half the sampling rate of 200 Hz"),
    "not excited": (dict(lines=str([*map(int, LINES), 110])), "nothing was excited at line 110 (55 Hz)"),
    "no lines": (dict(lines="[]"), "lines: expected whole numbers from 1 on"),
    "no f0": (dict(f0="none"), "f0: expected a finite number, got 'none'; docs/frequency.md"),
}


@pytest.mark.parametrize("case", REFUSED, ids=str)
def test_descriptions_that_do_not_fit_are_refused_in_one_line(case, tmp_path, capsys):
    change, text = REFUSED[case]
    describe(tmp_path, write(tmp_path), **change)
    assert main(["frequency", str(tmp_path / "run"), "-o", str(tmp_path / "f.npz")]) == 1
    error = capsys.readouterr().err
    assert text in error and error.count("\n") == 1
    assert not (tmp_path / "f.npz").exists()


def test_a_field_that_is_not_there_is_corrected_where_it_was_written(tmp_path, capsys):
    write(tmp_path)
    assert main(["frequency", str(tmp_path / "run"), "--from", "/joint_states:efort"]) == 1
    error = capsys.readouterr().err
    assert "has no field 'efort'" in error and "correct TOPIC:FIELD" in error and "robot file" not in error


def test_an_experiment_that_is_not_in_the_bag_is_refused(tmp_path, capsys):
    excitation = write(tmp_path)
    late = replace(excitation, experiments=tuple(replace(e, start=e.start + 100.0) for e in excitation.experiments))
    describe(tmp_path, late)
    assert main(["frequency", str(tmp_path / "run")]) == 1
    assert "the excitation belongs to another recording, or this one was cut off" in capsys.readouterr().err


def test_an_experiment_that_is_listed_twice_and_half_a_line_are_refused(tmp_path, capsys):
    excitation = write(tmp_path)
    first = excitation.experiments[0]
    describe(tmp_path, replace(excitation, experiments=(first, *excitation.experiments)))
    assert main(["frequency", str(tmp_path / "run")]) == 1
    assert "realisation 0, experiment 0, sign 1 of the bag 'run' is listed twice; give each" in capsys.readouterr().err
    describe(tmp_path, excitation, lines="[1.5, 3]")
    assert main(["frequency", str(tmp_path / "run")]) == 1
    assert "lines: expected whole numbers from 1 on, got [1.5, 3.0]" in capsys.readouterr().err


def test_clipped_torques_are_refused(tmp_path, capsys):
    write(tmp_path, u=lambda values: np.clip(values, -6.0, 6.0))
    assert main(["frequency", str(tmp_path / "run")]) == 1
    assert "a stands at 6 in " in capsys.readouterr().err


def test_a_topic_that_is_not_there_is_named(made, capsys):
    assert main(["frequency", str(made / "run"), "--from", "/joint_state:effort"]) == 1
    assert "topic /joint_state is missing; did you mean '/joint_states'?" in capsys.readouterr().err
    assert main(["frequency", str(made / "run"), "--to", "/joint_states:position:c"]) == 1
    assert "no 'c' in it; it names a, b" in capsys.readouterr().err
    assert main(["frequency", str(made / "run"), "--from", "/joint_states"]) == 1
    assert "expected TOPIC:FIELD or TOPIC:FIELD:NAME,NAME" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(not TX90L.is_dir(), reason="shared/data/tx90l is not beside the project")
def test_the_motors_of_an_arm_are_taken_by_themselves_and_friction_is_not_noise(tmp_path):
    assert main(["frequency", str(TX90L / "frequency_P1"), "--json", str(tmp_path / "f.json")]) == 0
    (content,) = json.loads((tmp_path / "f.json").read_text())["responses"]
    assert content["inputs"] == content["outputs"] == ["joint1", "joint2", "joint3"]
    assert content["excitation"]["pairs"] and content["excitation"]["realisations"] == 2
    noise, total = np.array(content["noise"]), np.array(content["total"])
    assert np.diag(noise).max() < 1e-3 and np.all(np.diag(total) > 50.0 * np.diag(noise))


def test_a_record_without_whole_periods_goes_by_local_polynomials_and_says_so(tmp_path, capsys):
    u = np.random.default_rng(0).standard_normal((4000, 2))
    y = two_by_two(u)
    stamps = np.rint(np.arange(len(u)) / RATE * 1e9).astype(np.int64) + 1_700_000_000_000_000_000
    fields = {"effort": u, "position": y}
    write_topics(tmp_path / "noise", [joint_states("/joint_states", ("a", "b"), stamps, fields)])
    files = {"-o": "f.npz", "--report": "f.html", "--json": "f.json"}
    options = [text for option, name in files.items() for text in (option, str(tmp_path / name))]
    assert main(["frequency", str(tmp_path / "noise"), *options]) == 0
    screen = capsys.readouterr().out
    assert "a stretch of 20 s without whole periods" in screen and "polynomials of order 2 over 17 lines" in screen
    assert "Record two periods or more" in screen
    arrays = np.load(tmp_path / "f.npz")
    f = arrays["frequency_hz"]
    middle = (f > 15.0) & (f < 40.0)
    np.testing.assert_allclose(arrays["response"][middle], true_response(f[middle]), atol=2e-4)
    assert "noise_covariance" not in arrays and arrays["total_covariance"].shape == (len(f), 4, 4)
    (content,) = json.loads((tmp_path / "f.json").read_text())["responses"]
    assert content["excitation"]["whole_periods"] is False and content["noise"] is None
    page = (tmp_path / "f.html").read_text()
    assert "two sigmas, total" in page and "even lines" not in page
