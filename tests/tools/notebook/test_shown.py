# SPDX-License-Identifier: BSD-3-Clause
"""Results in a notebook: text, table, data frame, figure; and what is said where pandas or matplotlib are missing."""

from __future__ import annotations

import dataclasses
import html
import importlib
import json
import re
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from fake_diagnosis import fake_diagnosis, fake_discovery
from fake_results import fake_calibration, fake_comparison

import jointscope as js
from jointscope.graphs.calibration.calibration_graph import CalibrationGraph
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.errors import JointscopeError, RobotError
from jointscope.tools.acceptance.evaluation import check_models
from jointscope.tools.notebook.given import limits_of
from jointscope.tools.notebook.results import Calibrated, Compared, Diagnosed, Discovered
from jointscope.tools.notebook.shown import SHOWN_ROWS, SHOWN_WIDTH
from jointscope.tools.terminal.calibration_text import calibration_text


@pytest.fixture(scope="module")
def calibrated():
    return Calibrated.of(fake_calibration())


@pytest.fixture(scope="module")
def simulated():
    pytest.importorskip("mujoco", reason="comes with the extra sim")
    return js.simulate("doggy", seconds=2.0, seed=1, effects=["cogging@joint1"])


@pytest.fixture(scope="module")
def results(calibrated, simulated):
    comparison = Compared.of(fake_comparison())
    return [calibrated, comparison, Diagnosed.of(fake_diagnosis()), Discovered.of(fake_discovery()), simulated]


def test_a_result_is_still_the_result_of_the_computation(calibrated):
    assert isinstance(calibrated, CalibrationResult)
    assert dataclasses.replace(calibrated, cost=3.0).cost == 3.0
    assert CalibrationGraph.of.__name__ == "of"


def test_a_parameter_is_found_by_its_name_and_an_unknown_one_is_told_with_those_there_are(calibrated):
    assert calibrated["joint2.stiffness"].unit == "N m/rad"
    with pytest.raises(RobotError, match=r"^there is no parameter 'joint9\.stiffness'; did you mean 'joint\d\."):
        calibrated["joint9.stiffness"]


def test_a_notebook_shows_the_answer_and_a_table_whose_texts_are_escaped(results):
    for result in results:
        shown = result._repr_html_()
        assert shown.startswith("<p><b>") and result.answer().split(",")[0][:20] in shown
        assert shown.count("<tr>") == 1 + min(len(result.rows()), SHOWN_ROWS)
        assert "<train" not in shown


def test_print_shows_the_answer_and_a_plain_table_that_fits_a_screen(results):
    for result in results:
        printed = str(result)
        assert printed == repr(result) and printed.startswith(result.answer())
        first = next(iter(result.rows()[0].values()))
        assert str(first) in printed.removeprefix(result.answer())
        assert all(len(line) <= SHOWN_WIDTH for line in printed.removeprefix(result.answer()).splitlines())
        assert len(printed) < 12_000


def test_a_printed_table_has_the_values_and_says_what_is_left(calibrated):
    stiffness = calibrated["joint2.stiffness"]
    (line,) = (line for line in str(calibrated).splitlines() if line.startswith("  joint2.stiffness "))
    assert float(line.split()[1]) == pytest.approx(stiffness.value, rel=1e-4)
    assert "N m/rad" in line
    many = dataclasses.replace(calibrated, parameters=calibrated.parameters[:1] * 50, derived=())
    assert str(many).splitlines()[-1] == "  (10 more rows: rows(), to_dataframe())"


def test_a_recording_and_what_is_in_a_bag_print_in_words(simulated, tmp_path):
    printed = str(dataclasses.replace(simulated.recording, path="it.mcap"))
    assert printed.startswith("it.mcap: ") and "command (2000 samples, 3 channels)" in printed and "\n" not in printed
    js.simulate("doggy", tmp_path / "it.mcap", seconds=1.0, seed=1)
    described = js.info(tmp_path / "it.mcap", "doggy")
    assert str(described) == described.text()


def test_an_answer_holds_the_reasons_and_a_title_only_the_verdict(calibrated, tmp_path):
    """The same as on the screen and in the report."""
    channel, fit = next(iter(calibrated.channels.items()))
    bad = {**calibrated.channels, channel: dataclasses.replace(fit, chi2=4.0)}
    doubtful = dataclasses.replace(calibrated, channels=bad)
    verdict, *reasons = doubtful.answer().splitlines()
    assert verdict == "No, do not rely on this calibration yet."
    assert any(line.startswith(f"  ! Residuals as large as the sensor noise? {channel} has") for line in reasons)
    assert doubtful.answer() in calibration_text(doubtful)
    assert all(line.partition("? ")[2] in html.unescape(doubtful._repr_html_()) for line in reasons)
    doubtful.save(json=tmp_path / "it.json")
    content = json.loads((tmp_path / "it.json").read_text())
    assert content["verdict"] == {"level": "bad", "text": verdict}
    told = [f"  ! {c['name']}? {c['why']}" for c in content["checks"] if c["verdict"] in ("warn", "bad")]
    assert told == reasons
    assert {"parameters", "channels", "findings"} <= content.keys()


def test_rows_have_one_shape(results):
    for result in results:
        assert result.rows()
        assert len({tuple(row) for row in result.rows()}) == 1


def test_a_data_frame_is_made_of_the_rows(calibrated, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=lambda rows: ("frame", rows)))
    kind, rows = calibrated.to_dataframe()
    assert kind == "frame"
    assert {row["parameter"]: row["value"] for row in rows}["joint2.stiffness"] == calibrated["joint2.stiffness"].value


def test_a_missing_extra_is_one_line_that_says_which(calibrated, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    with pytest.raises(JointscopeError) as told:
        calibrated.to_dataframe()
    assert str(told.value) == "to_dataframe() needs pandas, which is not installed; do: pip install pandas"
    with pytest.raises(JointscopeError) as told:
        calibrated.plot()
    assert str(told.value) == "plot() needs matplotlib, which is not installed; do: pip install 'jointscope[plot]'"


def test_figures_need_no_display(results, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib", reason="comes with the extra plot")
    monkeypatch.delenv("DISPLAY", raising=False)
    for k, result in enumerate(results):
        result.plot().savefig(tmp_path / f"{k}.svg")
        assert (tmp_path / f"{k}.svg").stat().st_size > 5000
    assert not importlib.import_module("matplotlib.pyplot").get_fignums()


@pytest.mark.parametrize("worst, labels", [(1.04, ["0.5", "1", "2"]), (480.0, ["1", "10", "100"])])
def test_errors_near_the_noise_are_drawn_on_an_axis_on_which_they_look_alike(worst, labels):
    pyplot = pytest.importorskip("matplotlib.pyplot", reason="comes with the extra plot")
    comparison = Compared.of(fake_comparison())
    errors = np.linspace(0.97, worst, len(comparison.models[0].channels))

    def scaled(model):
        pairs = zip(model.channels.items(), errors, strict=True)
        return {n: dataclasses.replace(c, horizons={**c.horizons, "0.1": e * c.noise_sigma}) for (n, c), e in pairs}

    models = tuple(dataclasses.replace(m, channels=scaled(m)) for m in comparison.models)
    figure, axes = pyplot.subplots()
    dataclasses.replace(comparison, models=models).draw(axes)
    low, high = axes.get_ylim()
    assert low <= 0.5 and high >= max(3.0, worst)
    assert [label.get_text() for label in axes.get_yticklabels()] == labels
    pyplot.close(figure)


def test_a_figure_is_drawn_into_axes_that_are_given(results):
    """With a stand-in for axes, so that the curves are looked at where matplotlib is not installed, too."""
    calibrated = results[0]
    drawn = []

    class Axes:
        figure = "the figure"

        def plot(self, x, y, **style):
            drawn.append((style["label"], np.asarray(y)))

        def __getattr__(self, name):
            return lambda *args, **kwargs: None

    try:
        importlib.import_module("matplotlib.pyplot")
    except ImportError:
        calibrated.draw(Axes())
    else:
        assert calibrated.plot(Axes()) == "the figure"
    assert [label for label, _ in drawn] == list(calibrated.channels)
    assert all(0.5 < np.std(y[np.isfinite(y)]) < 2.0 for _, y in drawn)


def test_saving_writes_what_the_verb_writes(calibrated, tmp_path):
    calibrated.save(tmp_path / "a.yaml", report=tmp_path / "a.html", json=tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text())["parameters"]["joint2.stiffness"]["unit"] == "N m/rad"
    assert {file.name for file in tmp_path.iterdir()} == {"a.yaml", "a.html", "a.json"}


def test_parameters_are_asked_by_name_and_print_a_line_each(calibrated):
    stiffness = calibrated.parameters["joint2.stiffness"]
    assert stiffness is calibrated["joint2.stiffness"]
    assert re.fullmatch(r"joint2\.stiffness = [\d.]+ ± [\d.]+ N m/rad, prior 400 ± 600(, .+)?", repr(stiffness))
    assert f"{stiffness}" == repr(stiffness)
    assert "<b>joint2.stiffness</b> = " in stiffness._repr_html_() and "\n" not in stiffness._repr_html_()
    lines = repr(calibrated.parameters).splitlines()
    assert len(lines) == len(calibrated.parameters) and repr(stiffness) in lines
    assert calibrated.parameters[:1] == (calibrated.parameters[0],)
    assert stiffness._repr_html_() in calibrated.parameters._repr_html_()
    with pytest.raises(RobotError, match=r"'joint2\.stifness'; did you mean 'joint2\.stiffness'\?$"):
        calibrated.parameters["joint2.stifness"]


def test_a_parameter_of_a_robot_prints_as_a_line():
    robot = js.load_robot("doggy")
    assert repr(robot.parameters["joint1.stiffness"]) == "joint1.stiffness = 400 N m/rad, prior 400 ± 600"
    held = dataclasses.replace(robot.parameters["joint1.stiffness"], sigma=0.25, fixed=True)
    assert str(held) == "joint1.stiffness = 400 ± 0.25 N m/rad, prior 400 ± 600, fixed"


def test_a_simulation_says_what_it_is_and_saves_its_truth_alone(simulated, tmp_path):
    assert simulated.answer().startswith("2 s of doggy, motion calibration, seed 1, ")
    assert simulated.answer().endswith("effects: cogging@joint1")
    assert {row["stream"]: row["samples"] for row in simulated.rows()}["command"] == len(simulated.recording.command)
    simulated.save(json=tmp_path / "truth.json")
    assert json.loads((tmp_path / "truth.json").read_text())["seed"] == 1
    with pytest.raises(JointscopeError, match=r"its bag: simulate\(robot, 'recording\.mcap'\)"):
        simulated.save(report=tmp_path / "no.html")


def limited(found, folder, *lines: str):
    """A made-up result held against limits, as `calibrate` and `compare` do it."""
    (folder / "limits.yaml").write_text("limits:\n" + "".join(f"  - {{{line}, because: a bench}}\n" for line in lines))
    limits = limits_of(folder / "limits.yaml", [found.robot])
    return Calibrated.of(found, acceptance=check_models(limits, {"doggy": found.to_json()}))


def test_without_limits_a_result_is_not_evaluated_and_never_accepted_by_silence(calibrated):
    assert calibrated.accepted == "not evaluated" and calibrated.acceptance == {}
    assert "Accepted" not in calibrated._repr_html_()


@pytest.mark.parametrize(
    ("lines", "outcome", "said"),
    [
        (["parameter: joint2.stiffness, at_least: 1 N m/rad"], "pass", "Accepted: the limit is met."),
        (
            ["parameter: joint2.stiffness, at_least: 1 N m/rad", "parameter: joint2.stiffness, at_most: 1 N m/rad"],
            "fail",
            "Not accepted: 1 of 2 limits",
        ),
        (
            ["parameter: joint2.stiffness, at_least: 1 N m/rad", "poses: all, p90_mm: 1"],
            "not evaluated",
            "Undecided: 1 of 2",
        ),
    ],
)
def test_limits_are_shown_and_saved_with_the_result(lines, outcome, said, tmp_path):
    result = limited(fake_calibration(), tmp_path, *lines)
    assert result.accepted == outcome
    assert said in result._repr_html_()
    assert said in str(result) and f"  {outcome}  " in str(result)
    result.save(report=tmp_path / "r.html", json=tmp_path / "r.json")
    assert said in (tmp_path / "r.html").read_text()
    assert outcome in {line["outcome"] for line in json.loads((tmp_path / "r.json").read_text())["acceptance"]["doggy"]}


def test_no_file_of_a_result_replaces_what_it_was_made_from(calibrated, tmp_path):
    bag, file, urdf = tmp_path / "m.mcap", tmp_path / "arm.yaml", tmp_path / "arm.urdf"
    bag.write_bytes(b"samples")
    file.write_text("urdf: arm.urdf\n")
    urdf.write_text("<robot/>")
    (first, *others), start = calibrated.bags, dataclasses.replace(calibrated.start, path=file)
    first = dataclasses.replace(first, recording=dataclasses.replace(first.recording, path=str(bag)))
    result = dataclasses.replace(calibrated, bags=(first, *others), start=start)
    for given, reason in (
        ({"report": bag}, "it is also an input"),
        ({"json": file}, "it is also an input"),
        ({"robot": urdf}, f"it is the URDF of {file}"),
        ({"robot": tmp_path / "a.yaml", "report": tmp_path / "a.yaml"}, "it is named for two outputs"),
    ):
        before = {path: path.read_bytes() for path in tmp_path.iterdir()}
        with pytest.raises(JointscopeError, match=f"^cannot write .*: {reason}; give it another name$"):
            result.save(**given)
        assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
