# SPDX-License-Identifier: BSD-3-Clause
"""How far estimated link velocities are from the truth, beside a Kalman filter, derivatives and the batch smoother."""

from __future__ import annotations

import time
from collections import defaultdict

import numpy as np
from estimator_case import Case, make_case
from estimator_run import LAG, SETTLED, Run, run
from kalman_filter import filtered
from message_feed import in_order
from numpy.typing import NDArray
from patience import say
from scipy.signal import butter, sosfilt
from tables import Section, Table

from jointscope.graphs.comparison.compare import smooth
from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

AS_GOOD = 1.0  # times the Kalman filter's error, to a thousandth: with the same model and noise it is a tie
LIMIT = 1.05  # times the batch smoother's
NEAR = 1.0  # [sigma of the lagged states] rms distance from the batch smoother
CORNERS = (5.0, 10.0, 20.0, 50.0, 100.0)  # [Hz] of the low-pass behind the differentiated encoders
OURS, KALMAN, BY_HAND, LAGGED, BATCH = (
    "FixedLagEstimator, newest state",
    "extended Kalman filter, same model and noise",
    "the same filter, encoder noise as in the robot file",
    f"FixedLagEstimator, {LAG:g} s later",
    "batch smoother",
)


def run_section(quick: bool) -> Section:
    """True parameters and matching noise; `quick` takes two short recordings."""
    seeds, seconds = ((1, 2), 3.0) if quick else (tuple(range(1, 6)), 6.0)
    section = Section(
        "Estimator: accuracy",
        f"Root mean square error of the link velocities against the simulator's truth, {len(seeds)} recordings of "
        f"{seconds:g} s of moves with white random torques of 0.3 N m on links and rotors, without the first second. "
        "All estimators know the true parameters and the noise that belongs to the torques.",
    )
    errors: dict[str, list[Array]] = defaultdict(list)
    distances: list[Array] = []
    for seed in seeds:
        say(f"accuracy: seed {seed}")
        case = make_case(seed, seconds)
        ours = run(case, case.robot, in_order(case.recording))
        errors[OURS].append(ours.now.link_velocity_error)
        errors[LAGGED].append(ours.lagged.link_velocity_error)
        _kalman(section, errors, case, ours)
        distances.append(_batch(errors, case, ours))
        _derivatives(errors, case)
    by_recording = {name: [_rms(error) for error in found] for name, found in errors.items()}
    _report(section, by_recording, np.concatenate(distances))
    return section


def _kalman(section: Section, errors: dict[str, list[Array]], case: Case, ours: Run) -> None:
    """At the ticks at which ours was asked, begun when ours began."""
    since = ours.estimator.events[0].time
    for name, like_ours in ((KALMAN, True), (BY_HAND, False)):
        began = time.thread_time()
        times, states = filtered(case.robot, case.recording, like_ours, since)
        section.numbers["kalman_ms"] = 1e3 * (time.thread_time() - began) / len(times)
        here = times > SETTLED
        errors[name].append(states[here][:, case.robot.layout.joint_v] - _true_velocity(case, times[here]))


def _batch(errors: dict[str, list[Array]], case: Case, ours: Run) -> Array:
    """At the ticks of the lagged states; distances of these from the batch smoother in their sigmas."""
    problem, states, _ = smooth(case.robot, case.recording)
    ticks = np.searchsorted(problem.timeline.ticks, ours.lagged.times - 1e-6)
    batch = case.robot.layout.by_joint(states[ticks])
    n = case.robot.n
    errors[BATCH].append(batch[:, n : 2 * n] - _true_velocity(case, ours.lagged.times))
    return (ours.lagged.estimated - batch) / ours.lagged.sigma


def _derivatives(errors: dict[str, list[Array]], case: Case) -> None:
    encoder = case.recording.streams[case.robot.motor_encoder.name]
    here = encoder.times > SETTLED
    truth = _true_velocity(case, encoder.times[here])
    for corner in CORNERS:
        errors[_derivative(corner)].append(_differentiated(encoder, corner)[here] - truth)


def _derivative(corner: float) -> str:
    return f"differentiated motor encoders, Butterworth of order 2, {corner:g} Hz"


def _differentiated(encoder: Stream, corner: float) -> Array:
    """Velocity that a controller without a model would use, causal, shape (m, n) [rad/s]."""
    rate = 1.0 / float(np.median(np.diff(encoder.times)))
    slope = np.diff(encoder.values, axis=0, prepend=encoder.values[:1]) * rate
    return sosfilt(butter(2, corner, fs=rate, output="sos"), slope, axis=0)


def _true_velocity(case: Case, times: Array) -> Array:
    n = case.robot.n
    return case.truth(times)[:, n : 2 * n]


def _report(section: Section, errors: dict[str, list[float]], distances: Array) -> None:
    def ratio(above: str, below: str) -> tuple[float, str]:
        each = np.array(errors[above]) / np.array(errors[below])
        pooled = _rms(np.array(errors[above])) / _rms(np.array(errors[below]))
        return pooled, f"{pooled:.4f} times ({each.min():.4f} to {each.max():.4f})"

    value, text = ratio(OURS, KALMAN)
    met = round(value, 3) <= AS_GOOD
    section.promise("newest state, over the extended Kalman filter", f"at most {AS_GOOD:g}, to a thousandth", text, met)
    section.promise("&nbsp;&nbsp;over the filter without weights for coarse encoders", "", ratio(OURS, BY_HAND)[1])
    best = min((_derivative(corner) for corner in CORNERS), key=lambda name: _rms(np.array(errors[name])))
    section.promise("&nbsp;&nbsp;over the best differentiated encoders", "", ratio(OURS, best)[1])
    value, text = ratio(LAGGED, BATCH)
    section.promise(f"{LAG:g} s later, over the batch smoother", f"at most {LIMIT:g}", text, value <= LIMIT)
    rms, largest = float(_rms(distances)), float(np.abs(distances).max())
    section.promise(
        "lagged states, distance from the batch smoother's",
        f"rms below {NEAR:g} sigma",
        f"rms {rms:.2f} sigma, at most {largest:.1f} sigma",
        rms < NEAR,
    )
    rows = [
        (name, f"{1e3 * _rms(np.array(found)):.3f}", f"{1e3 * min(found):.3f}", f"{1e3 * max(found):.3f}")
        for name, found in errors.items()
    ]
    head = ("estimator", "all [mrad/s]", "best recording", "worst")
    section.tables.append(Table("Root mean square error of the link velocities", head, rows))
    section.notes.append(
        "Samples of a quantized encoder share their errors in slow motion; the estimator and the batch smoother give "
        "them less weight there, and so does the Kalman filter with the same noise. It needs "
        f"{section.numbers['kalman_ms']:.2f} ms of CPU time per tick."
    )
    section.numbers |= {"rmse": errors, "distance_sigma": {"rms": rms, "max": largest}}


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))
