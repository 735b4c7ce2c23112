# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from fake_estimator import FakeEstimator
from fake_results import fake_recording, sinusoids

import jointscope.graphs.fixed_lag.replay.replay as replay_module
from jointscope.graphs.fixed_lag.replay.batch_agreement import BatchAgreement, batch_agreement
from jointscope.graphs.fixed_lag.replay.corrections import corrections
from jointscope.graphs.fixed_lag.replay.nis_windows import NisWindows
from jointscope.graphs.fixed_lag.replay.replay import SMOOTHED_EVERY, replay
from jointscope.graphs.fixed_lag.replay.tick_log import ThinnedRows
from jointscope.robots.errors import EstimatorError, RecordingError
from jointscope.robots.recordings.arrivals import Arrivals
from jointscope.robots.recordings.recording import Recording, Stream


@pytest.fixture
def recording(doggy, monkeypatch):
    """One second; the made-up estimator knows its truth."""
    t = np.arange(1000) * 1e-3
    x = sinusoids(t, doggy)
    monkeypatch.setattr(replay_module, "FixedLagEstimator", FakeEstimator)
    monkeypatch.setattr(FakeEstimator, "truth", (t, x))
    monkeypatch.setattr(FakeEstimator, "sick", ())
    return fake_recording(doggy, x, t, np.random.default_rng(0))


def arriving(recording, name, **changes):
    """The recording with one stream changed."""
    streams = {**recording.streams, name: dataclasses.replace(recording.streams[name], **changes)}
    return dataclasses.replace(recording, streams=streams)


def test_messages_are_fed_in_the_order_of_arrival_whatever_their_stamps(doggy, recording):
    rng = np.random.default_rng(3)
    times = recording.streams["imu1"].times
    mixed = arriving(recording, "imu1", received=times + rng.uniform(0.0, 5e-3, len(times)))
    result = replay(doggy, mixed)
    fed = [(name, t) for name, t, _ in FakeEstimator.last.fed]
    assert fed == [(name, stamp) for _, name, stamp, _ in Arrivals.of(mixed)]
    gyro = np.array([t for name, t in fed if name == "imu1"])
    assert np.any(np.diff(gyro) < 0.0)
    assert result.status.late["imu1"] == np.count_nonzero(gyro < np.maximum.accumulate(gyro))


def test_values_that_are_no_numbers_and_duplicates_reach_the_estimator_and_are_counted(doggy, recording):
    s = recording.streams["imu2"]
    values = s.values.copy()
    values[100:110] = np.nan
    twice = np.r_[np.arange(1000), 500]
    bad = arriving(recording, "imu2", times=s.times[twice], values=values[twice], received=np.r_[s.times, 0.5001])
    result = replay(doggy, bad)
    assert result.status.received["imu2"] == 1001
    assert result.dropped == 10 + 1
    assert result.to_json()["dropped_by"] == {"imu2": {"not_finite": 10, "duplicate": 1}}


def test_one_update_per_command_with_latency_and_states(doggy, recording):
    result = replay(doggy, recording, 0.1, adapt={"joint1.stiffness": 0.5})
    assert result.updates == 1000
    assert result.stride == 1
    np.testing.assert_array_equal(result.states.times, recording.command.times)
    assert result.states.mean.shape == result.states.sigma.shape == (1000, 12)
    assert 0.0 < result.latency.p50 <= result.latency.p99 <= result.latency.max
    assert result.recording_seconds == pytest.approx(0.999)
    assert result.states.parameters["joint1.stiffness"].shape == (1000, 2)
    np.testing.assert_allclose(result.lagged.times, np.arange(0.0, 0.9, 0.02), atol=1e-9)


def test_the_state_at_the_lag_is_read_as_often_as_wanted(doggy, recording):
    lagged = replay(doggy, recording).lagged
    assert len(lagged.times) == 900 // SMOOTHED_EVERY
    assert np.isfinite(lagged.sigma).all() and np.isfinite(lagged.mean).all()
    assert len(replay(doggy, recording, smoothed_every=1).lagged.times) == 900


def test_the_sigma_of_the_deflection_knows_the_correlation(doggy, recording):
    result = replay(doggy, recording)
    P, i = FakeEstimator.last.covariance, 1
    wobble = 1.0 + 0.3 * np.sin(2.0 * result.states.times)
    expected = wobble * np.sqrt(P[i, i] + P[6 + i, 6 + i] - 2.0 * P[i, 6 + i])
    np.testing.assert_allclose(result.states.deflection_sigma[:, i], expected, rtol=1e-9)


def test_nis_is_that_of_all_used_innovations(doggy, recording):
    result = replay(doggy, recording)
    assert {name: s.count for name, s in result.innovations.items()} == dict.fromkeys(doggy.sensors, 1000)
    total = np.concatenate([s.nis for s in result.innovations.values()]).sum()
    # the innovations that came after the last command belong to no tick
    assert result.nis_mean == pytest.approx(total / 9000, rel=1e-9)
    assert result.nis_mean == pytest.approx(1.0, abs=0.1)
    series = result.innovations["imu1"]
    np.testing.assert_allclose(
        series.channel_nis["imu1.y"], np.mean((series.residual[:, 1] / series.sigma[:, 1]) ** 2), rtol=1e-9
    )


def test_an_alarm_names_the_channel_and_windows_show_when(doggy, recording, monkeypatch):
    monkeypatch.setattr(FakeEstimator, "sick", ("imu1",))
    result = replay(doggy, recording)
    assert result.alarms == {"imu1.x": 1}
    assert result.event_counts == {"started": 1, "alarm": 1}
    windows = NisWindows.of(result.innovations["imu1"])
    first = windows.times < 0.45
    assert np.all(windows.sensor[first] < windows.high[first])
    assert np.all(windows.sensor[windows.times > 0.6] > 10.0 * windows.high[-1])
    healthy = NisWindows.of(result.innovations["imu2"])
    assert healthy.outside == 0.0


def test_the_bounds_of_a_window_hold_999_of_1000_consistent_windows(doggy, recording):
    rng = np.random.default_rng(9)
    template = replay(doggy, recording).innovations["imu1"]
    n = 400_000
    z = rng.normal(size=(n, 3))
    series = dataclasses.replace(
        template,
        times=np.arange(n) * 1e-3,
        residual=z,
        sigma=np.ones((n, 3)),
        nis=np.sum(z**2, axis=1),
        dof=np.full(n, 3.0),
        used=np.ones(n, dtype=bool),
    )
    assert NisWindows.of(series).outside < 0.006  # 1600 windows, 1.6 expected outside


def test_listeners_get_every_tick_with_its_events(doggy, recording):
    told = []
    replay(doggy, recording, listener=lambda tick, lagged, events: told.append((tick.state.time, lagged, events)))
    assert len(told) == 1000
    assert [event.kind for event in told[0][2]] == ["started"]
    assert all(events == () for _, _, events in told[1:])
    assert told[50][1] is None and told[110][1] is None and told[980][1].time == pytest.approx(0.88)


def test_events_are_not_told_twice_though_the_estimator_keeps_only_the_last(doggy, recording):
    s = recording.streams["imu2"]
    values = s.values.copy()
    values[100:400] = np.inf
    result = replay(doggy, arriving(recording, "imu2", values=values))
    assert result.event_counts["not_finite"] == 300
    assert len(result.events) == 301


def test_a_recording_without_an_update_is_one_line(doggy, recording):
    none = dataclasses.replace(recording, streams={k: v for k, v in recording.streams.items() if k != "command"})
    nothing = Stream("command", np.zeros(0), np.zeros((0, 3)), recording.command.channels, "1")
    silent = dataclasses.replace(none, streams={**none.streams, "command": nothing})
    with pytest.raises(
        RecordingError, match=r"the estimator made no update from 3000 messages \(1000 of motor_encoder"
    ):
        replay(doggy, silent)


@pytest.mark.parametrize("count", (5, 64, 65, 128, 129, 1000))
def test_thinned_rows_are_every_kth_of_all(count):
    rows = ThinnedRows(2, most=64)
    for k in range(count):
        if (row := rows.next()) is not None:
            row[:] = k, -k
    expected = np.arange(0, count, rows.stride, dtype=float)
    np.testing.assert_array_equal(rows.rows, np.column_stack([expected, -expected]))
    assert len(rows.rows) <= 64
    assert rows.stride == 1 or len(rows.rows) > 31


def true_robot(robot, truth):
    """The robot as it was simulated, mounting errors included."""
    values = {name: value for name, value in truth.items() if name in robot.parameters}
    mounted = {
        gyro.name: dataclasses.replace(gyro, R_imu_body=np.array(truth[f"{gyro.name}.R_imu_body"]))
        for gyro in robot.gyros
    }
    return robot.with_values(values).with_sensors(mounted)


def agreement(size):
    """Differences of a given size in sigmas."""
    z = size * np.random.default_rng(5).normal(size=(5000, 2))
    return BatchAgreement(
        ("a", "b"), np.arange(5000.0), z, z, np.sqrt(np.mean(z**2, axis=0)), np.mean(np.abs(z) > 3, axis=0), z
    )


def test_agreement_is_within_the_sigmas_and_disagreement_says_where():
    assert agreement(0.6).agrees and agreement(0.6).apart == {}
    far = agreement(1.6)
    assert not far.agrees and set(far.apart) == {"a", "b"}
    name, time, sigmas = far.worst
    assert sigmas == pytest.approx(np.abs(far.in_sigmas).max())
    assert abs(far.in_sigmas[int(time), ("a", "b").index(name)]) == sigmas


def test_corrections_are_newest_minus_smoothed_at_the_same_time(doggy, recording):
    result = replay(doggy, recording, smoothed_every=1)
    found = {c.name: c for c in corrections(doggy, result.states, result.lagged)}["v_link"]
    assert len(found.times) == 900
    spread = np.std(found.difference / found.sigma)
    assert 0.9 < spread < 1.6  # the fake draws both with independent noise: sqrt(1 + 0.36) over a wobbling sigma


@pytest.mark.slow
def test_the_estimator_agrees_with_the_batch_smoother(simulated, doggy):
    part = simulated.recording.between(0.0, 2.0)
    robot = true_robot(doggy, simulated.truth["parameters"])
    result = replay(robot, part)
    lagged = result.lagged
    found = batch_agreement(robot, part, lagged.times, lagged.mean, lagged.sigma)
    assert len(found.times) > 80
    assert np.median(found.rms) < 1.0
    assert found.rms[:6].max() < 1.5  # links; motors at rest share the error of a quantized encoder


def test_an_impossible_lag_or_parameter_is_refused(doggy, recording, monkeypatch):
    monkeypatch.undo()
    with pytest.raises(EstimatorError, match="lag"):
        replay(doggy, recording, -1.0)
    with pytest.raises(EstimatorError, match=r"joint9\.stiffness"):
        replay(doggy, recording, 0.1, adapt={"joint9.stiffness": 1.0})


def test_a_recording_type_hint_of_blocks_is_taken_as_blocks(doggy, recording):
    assert isinstance(recording, Recording)
    as_blocks = replay(doggy, [Arrivals.of(recording)])
    assert as_blocks.updates == replay(doggy, recording).updates
