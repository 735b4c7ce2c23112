# SPDX-License-Identifier: BSD-3-Clause
"""The verb with an estimator that knows the truth: what it says, what it writes, and what it refuses in one line."""

from __future__ import annotations

import csv
import dataclasses
import json

import numpy as np
import pytest
from fake_estimator import FakeEstimator
from fake_results import fake_recording, sinusoids
from result_page import ResultPage

import jointscope.graphs.fixed_lag.replay.replay as replay_module
from jointscope.graphs.fixed_lag.replay.batch_agreement import batch_agreement
from jointscope.graphs.fixed_lag.window.state_names import state_names
from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import main
from jointscope.tools.report.replay_report import replay_report
from jointscope.tools.rerun_log.live_replay import live_replay
from jointscope.tools.rerun_log.log_replay import log_replay
from jointscope.tools.terminal.replay_text import replay_text
from jointscope.tools.verdicts.replay_judgement import judge_replay

SECTIONS = "verdict nis residuals states covariance batch latency messages events provenance"
SECONDS = 1.5


@pytest.fixture(autouse=True)
def known_truth(doggy, monkeypatch):
    t = np.arange(round(1000 * SECONDS)) * 1e-3
    monkeypatch.setattr(replay_module, "FixedLagEstimator", FakeEstimator)
    monkeypatch.setattr(FakeEstimator, "truth", (t, sinusoids(t, doggy)))
    monkeypatch.setattr(FakeEstimator, "sick", ())
    monkeypatch.setattr(FakeEstimator, "error", 1.0)


@pytest.fixture
def bag(doggy, tmp_path):
    recording = fake_recording(doggy, FakeEstimator.truth[1], FakeEstimator.truth[0], np.random.default_rng(0))
    stream = recording.streams["imu1"]
    values = stream.values.copy()
    values[300:305] = np.nan
    streams = {**recording.streams, "imu1": dataclasses.replace(stream, values=values)}
    write_bag(tmp_path / "run one.mcap", dataclasses.replace(recording, streams=streams), doggy)
    return tmp_path / "run one.mcap"


@pytest.fixture
def result(doggy, bag):
    from jointscope.tools.bags.read_arrivals import ArrivalReader

    arrivals = ArrivalReader(bag, doggy)
    found = replay_module.replay(doggy, arrivals, 0.1, adapt={"joint1.stiffness": 0.5})
    return dataclasses.replace(found, source=arrivals.source(found.recording_seconds, "doggy"))


def test_json_has_what_the_interface_promises_and_more(bag, tmp_path, capsys):
    assert main(["replay", "doggy", str(bag), "--no-batch", "--json", str(tmp_path / "run.json")]) == 0
    found = json.loads((tmp_path / "run.json").read_text())
    assert found["updates"] == 1500
    assert found["recording_seconds"] == pytest.approx(1.499)
    assert found["wall_seconds"] > 0.0
    assert set(found["latency_ms"]) >= {"p50", "p99", "max"}
    assert found["nis_mean"] == pytest.approx(1.0, abs=0.1)
    assert found["dropped"] == 5 and found["dropped_by"] == {"imu1": {"not_finite": 5}}
    assert set(found["sensors"]) == {"motor_encoder", "imu1", "imu2"}
    assert set(found["sensors"]["imu1"]["channels"]) == {"imu1.x", "imu1.y", "imu1.z"}
    assert found["alarms"] == {} and found["agreement"] is None
    assert found["events"][0]["kind"] == "started"
    screen = capsys.readouterr().out
    assert "1500 updates over 1.5 s, lag 0.1 s" in screen
    assert "imu1: 5 of 1500 (5 not finite)" in screen
    assert "jointscope diagnose" not in screen


def test_an_alarm_names_the_sensor_and_the_command_that_asks_why(bag, capsys, monkeypatch):
    monkeypatch.setattr(FakeEstimator, "sick", ("imu1",))
    assert main(["replay", "doggy", str(bag), "--no-batch"]) == 0
    screen = capsys.readouterr().out
    assert "No: model and measurements contradict each other." in screen
    assert "imu1: the residuals of imu1." in screen
    assert screen.rstrip().endswith(f"jointscope diagnose doggy '{bag}'")


@pytest.mark.slow
def test_both_tables_hold_every_tick_with_mean_sigma_and_lagged_state(doggy, bag, tmp_path):
    import pyarrow.parquet

    seen = []
    for name in ("states.parquet", "states.csv"):
        assert main(["replay", "doggy", str(bag), "--no-batch", "-o", str(tmp_path / name), "--lagged-every", "1"]) == 0
        seen.append([tick for tick in FakeEstimator.last.fed if tick[0] == "command"])
    table = pyarrow.parquet.read_table(tmp_path / "states.parquet")
    with (tmp_path / "states.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert table.num_rows == len(rows) == 1500
    names = state_names(doggy.layout)
    for name in (*names, *(f"{n}.sigma" for n in names), "imu1.bias.x", "imu2.bias.z.sigma", f"lagged.{names[0]}"):
        assert name in table.column_names, name
    assert list(rows[0]) == table.column_names
    times = table["time"].to_numpy()
    np.testing.assert_allclose(times, [t for _, t, _ in seen[0]])
    error = table["joint2.v_link"].to_numpy() - FakeEstimator.truth[1][:, 4]
    assert np.std(error / table["joint2.v_link.sigma"].to_numpy()) == pytest.approx(1.0, abs=0.3)
    lagged = table["lagged.time"].to_numpy()
    assert np.isnan(lagged[:100]).all() and lagged[-1] == pytest.approx(times[-1] - 0.1)
    csv_column = np.array([float(row["joint2.v_link"]) for row in rows])
    np.testing.assert_array_equal(csv_column, table["joint2.v_link"].to_numpy())


@pytest.mark.parametrize(
    ("arguments", "message"),
    (
        (["doggy", "none.mcap"], "the bag none.mcap does not exist"),
        (["doggi", "{bag}"], "doggi"),
        (["doggy", "{bag}", "-o", "states.txt"], "expected a name that ends in .parquet or .csv, got '.txt'"),
        (["doggy", "{bag}", "-o", "{bag}"], "expected a name that ends in .parquet or .csv"),
        (["doggy", "{bag}", "--rrd", "{bag}"], "it is also an input"),
        (["doggy", "{bag}", "--report", "no/folder.html"], "does not exist; create it first"),
        (["doggy", "{bag}", "--json", "a", "--rrd", "a"], "is named for two outputs"),
    ),
)
def test_bad_input_is_one_line_and_exit_code_1(bag, tmp_path, capsys, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    assert main(["replay", *(argument.format(bag=bag) for argument in arguments)]) == 1
    error = capsys.readouterr().err
    assert error.startswith("jointscope: error: ") and message in error and error.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    "options",
    (
        ["--lag", "0"],
        ["--lag", "x"],
        ["--adapt", "joint1.stiffness"],
        ["--adapt", "a=-1"],
        ["--speed", "nan"],
        ["--lagged-every", "0"],
    ),
)
def test_wrong_usage_exits_with_2(bag, capsys, options):
    with pytest.raises(SystemExit) as leaving:
        main(["replay", "doggy", str(bag), *options])
    assert leaving.value.code == 2
    assert "expected" in capsys.readouterr().err


def test_a_damaged_bag_leaves_no_table_behind(bag, tmp_path, capsys):
    cut = tmp_path / "cut.mcap"
    whole = bag.read_bytes()
    cut.write_bytes(whole[: int(0.7 * len(whole))])
    assert main(["replay", "doggy", str(cut), "-o", str(tmp_path / "states.csv")]) == 1
    assert "cut.mcap" in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cut.mcap", "run one.mcap"]


def test_a_recording_that_the_batch_smoother_refuses_is_replayed_all_the_same(bag, capsys, monkeypatch):
    import jointscope.graphs.fixed_lag.replay.batch_agreement as module

    def refuse(*args):
        raise RecordingError("it is odd.")

    monkeypatch.setattr(module, "smooth", refuse)
    assert main(["replay", "doggy", str(bag)]) == 0
    assert "the batch smoother cannot work on this recording: it is odd." in capsys.readouterr().out
    assert main(["replay", "doggy", str(bag), "--batch"]) == 1
    assert capsys.readouterr().err == "jointscope: error: it is odd.\n"


@pytest.mark.slow
def test_the_batch_is_compared_and_disagreement_is_told(doggy, bag, capsys, monkeypatch):
    import jointscope.graphs.fixed_lag.replay.batch_agreement as module

    times, x = FakeEstimator.truth
    monkeypatch.setattr(module, "_smoothed", lambda robot, recording: (times, x))
    monkeypatch.setattr(FakeEstimator, "error", 0.5)
    assert main(["replay", "doggy", str(bag)]) == 0
    assert "ok Agrees with the batch smoother: All states at the lag are within 0." in capsys.readouterr().out
    monkeypatch.setattr(FakeEstimator, "error", 5.0)
    assert main(["replay", "doggy", str(bag)]) == 0
    assert "Agrees with the batch smoother: It does not: rms distance in sigmas" in capsys.readouterr().out


def test_agreement_needs_the_same_time_axis(doggy, monkeypatch):
    import jointscope.graphs.fixed_lag.replay.batch_agreement as module

    times, x = FakeEstimator.truth
    monkeypatch.setattr(module, "_smoothed", lambda robot, recording: (times + 7.0, x))
    monkeypatch.setattr(module, "_finite", lambda recording: recording)
    sigma = np.full_like(x, 1e-3)
    found = batch_agreement(doggy, None, times, x, sigma, later=7.0)
    assert len(found.times) == len(times) and np.abs(found.in_sigmas).max() < 1e-6


def entity_paths(file):
    from rerun.chunk import RrdReader

    return {str(path) for path in RrdReader(str(file)).store().schema().entity_paths()}


PATHS = {
    "/residuals/imu1/imu1.x/residual",
    "/residuals/motor_encoder/joint3.motor_position/band",
    "/nis/imu2/value",
    "/nis/imu2/bounds",
    "/states/joint2/v_link/now",
    "/states/joint2/v_link/band",
    "/states/joint2/v_link/lagged",
    "/sigma/deflection",
    "/bias/imu1/band",
    "/covariance/correlation",
    "/robot/head",
    "/robot/position_2_sigma",
    "/events",
    "/latency/update",
}


def test_the_file_of_the_viewer_has_all_parts(result, tmp_path):
    log_replay(result, tmp_path / "run.rrd")
    found = entity_paths(tmp_path / "run.rrd")
    extra = {
        "/findings",
        "/latency_histogram",
        "/corrections/joint1/v_motor/band",
        "/parameters/joint1.stiffness/value",
    }
    assert (PATHS | extra) - found == set()


def test_live_sends_the_same_parts_piece_by_piece(doggy, bag, tmp_path, monkeypatch):
    import rerun as rr

    from jointscope.tools.bags.read_arrivals import ArrivalReader
    from jointscope.tools.rerun_log import live_replay as module

    monkeypatch.setattr(module, "PAUSE", 0.0)
    stream = rr.RecordingStream("test")
    stream.save(tmp_path / "live.rrd")
    with live_replay(doggy, stream=stream) as live:
        replay_module.replay(doggy, ArrivalReader(bag, doggy), listener=live.add)
    assert PATHS - entity_paths(tmp_path / "live.rrd") == set()


def test_live_without_a_screen_or_a_viewer_is_one_line(bag, capsys, monkeypatch):
    from jointscope.tools.rerun_log import live_replay as module

    monkeypatch.setattr(module, "_listens", lambda: False)
    monkeypatch.setattr(module.sys, "platform", "linux")
    for name in module.SCREENS:
        monkeypatch.delenv(name, raising=False)
    assert main(["replay", "doggy", str(bag), "--live"]) == 1
    expected = "cannot show the replay live: there is no screen; write a file with --rrd and `jointscope view` it\n"
    assert capsys.readouterr().err == f"jointscope: error: {expected}"


def test_a_pace_waits_only_where_the_replay_is_ahead(monkeypatch):
    from types import SimpleNamespace

    from jointscope.tools.verb_parts import replay_listeners as module

    clock, slept = [10.0], []
    monkeypatch.setattr(module.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(module.time, "sleep", slept.append)
    pace = module.Pace(2.0)
    for wall, recorded in ((10.0, 1.0), (10.1, 1.4), (11.0, 1.5), (11.0, 4.0)):
        clock[0] = wall
        pace(SimpleNamespace(state=SimpleNamespace(time=recorded)), None, ())
    np.testing.assert_allclose(slept, [0.1, 0.5])


def test_every_section_of_the_report_is_there_and_holds_only_numbers(result):
    page = ResultPage(replay_report(result))
    assert [i for i in page.ids if i != "theme"] == SECTIONS.split()
    page.check()
    assert "Can this estimate be trusted?" in page.text
    assert "not finite" in page.text
    assert "joint1.stiffness" in page.text


def test_a_replay_that_hardly_began_has_a_report_too(doggy, tmp_path):
    t, x = FakeEstimator.truth
    recording = fake_recording(doggy, x[:3], t[:3], np.random.default_rng(0))
    short = replay_module.replay(doggy, recording)
    assert short.updates == 3 and not len(short.lagged.times)
    ResultPage(replay_report(short)).check()
    log_replay(short, tmp_path / "run.rrd")
    assert "3 updates" in replay_text(short)
    assert short.to_json()["nis_mean"] > 0.0


def test_slow_updates_are_told_without_blaming_the_estimate(result):
    slow = dataclasses.replace(result, latency=dataclasses.replace(result.latency, p99=0.1, mean=0.05))
    judged = judge_replay(slow)
    assert judged.headline.endswith("This machine is too slow for the rate of the commands.")
    assert "contradict" not in judged.headline
