# SPDX-License-Identifier: BSD-3-Clause
"""Where and when a model fails: per channel, regime of motion, and against the signals that drive the robot.

Errors are those of predictions 0.1 s ahead. Whiteness is tested with the shortest predictions there are, 0.01 s ahead
and 0.01 s apart, else with those 0.1 s ahead taken 0.1 s apart; standstill is left out, where the steps of an encoder
repeat the same error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.comparison.channel_errors import ChannelErrors, channel_errors
from jointscope.graphs.comparison.comparison_result import ModelComparison
from jointscope.graphs.comparison.error_concentration import concentration
from jointscope.graphs.comparison.error_correlation import JointSignals
from jointscope.graphs.comparison.failure_sentences import Finding, sentences
from jointscope.graphs.noise.whiteness_test import whiteness
from jointscope.graphs.problem.joint_states import JointStates
from jointscope.graphs.problem.motion_regimes import REGIMES, WHOLE_ROBOT, MotionRegimes, motion_regimes
from jointscope.robots.recordings.recording import Recording

__all__ = ["REGIMES", "ChannelFailure", "FailureAnalysis", "FailureWindow", "analyse_failure"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

WINDOW = 0.5  # [s]
WORST = 3  # windows per channel
FEWEST = 5  # predictions in a regime before its error means anything


@dataclass(frozen=True)
class FailureWindow:
    """A stretch of time in which one channel fails.

    Attributes:
        t0, t1: limits [s].
        error: root mean square error inside [sensor sigma].
        share: of the channel's squared error.
    """

    t0: float
    t1: float
    error: float
    share: float


@dataclass(frozen=True)
class ChannelFailure:
    """How one channel fails.

    Attributes:
        error: root mean square of the 0.1 s ahead prediction error [sensor sigma].
        regimes: the same within each regime that occurs, by name of REGIMES.
        regime_share: part of the channel's squared error that falls into each regime; regimes overlap.
        joint_of_regime: for each regime, the joint whose motion defines it best (largest error); "" for standstill
            and other, which belong to the whole robot.
        autocorrelation: of the residuals of the one-step predictions at lag one.
        whiteness_p: Ljung-Box p-value of those residuals.
        correlations: correlation of the prediction error with signals ("joint1.velocity", "joint1.sign(velocity)",
            "joint1.position", "joint1.deflection", "joint1.load", "joint1.command"), by name, strongest first.
        floor: what sensor noise and state uncertainty alone would leave of the error [sensor sigma].
        windows: stretches of half a second with the largest share, worst first.
    """

    error: float
    regimes: Mapping[str, float]
    regime_share: Mapping[str, float]
    joint_of_regime: Mapping[str, str]
    autocorrelation: float
    whiteness_p: float
    correlations: Mapping[str, float]
    floor: float = 1.0
    windows: tuple[FailureWindow, ...] = ()


@dataclass(frozen=True)
class FailureAnalysis:
    """Where a model fails in one recording.

    Attributes:
        channels: by channel, worst first.
        time_in_regime: share of the recording spent in each regime; regimes of different joints overlap.
        sentences: what this means, in plain words, worst first ("Gyro 1 sees 0.2 rad/s about its x axis where the
            model allows none, most of it when joint 2 reverses"); none for channels near their floor.
    """

    channels: Mapping[str, ChannelFailure]
    time_in_regime: Mapping[str, float]
    sentences: tuple[str, ...]


def analyse_failure(comparison: ModelComparison, recording: Recording) -> FailureAnalysis:
    """Says where one model fails.

    Args:
        comparison: the model against the recording.
        recording: the recording it was compared with.
    """
    robot = comparison.robot
    errors = sorted(channel_errors(comparison), key=lambda e: -e.excess)
    positions = _encoder_motion(comparison)
    motion, predicted = comparison.motion or positions, comparison.predicted_motion or positions
    if not errors or motion is None or predicted is None:
        return FailureAnalysis({}, {}, ())
    regimes = motion_regimes(robot, motion)
    signals = JointSignals(robot.joints, predicted, recording.command, regimes.still)
    channels, findings = {}, []
    for e in errors:
        masks = regimes.at(e.times)
        failure = _channel_failure(e, masks, regimes, robot.joints, signals)
        channels[e.channel] = failure
        where = concentration(e.error**2, masks)
        findings.append(Finding(e, where, masks, failure.correlations, failure.whiteness_p))
    time_in_regime = {name: float(np.mean(np.any(mask, axis=1))) for name, mask in regimes.masks.items()}
    isolated = tuple(f"{moment.sentence(recording)}." for moment in comparison.isolated)
    return FailureAnalysis(channels, time_in_regime, (*isolated, *sentences(findings, robot, regimes)))


def _encoder_motion(comparison: ModelComparison) -> JointStates | None:
    """Motion from the predicted encoder readings, for comparisons that kept no states."""
    encoder = comparison.robot.motor_encoder
    prediction = comparison.sensors[encoder.name]
    known = np.all(np.isfinite(prediction.ahead), axis=1)
    if np.sum(known) < FEWEST:
        return None
    return JointStates.of_positions(prediction.times[known], prediction.ahead[known] - encoder.zero)


def _channel_failure(
    e: ChannelErrors, masks: Mapping[str, Mask], regimes: MotionRegimes, joints: tuple[str, ...], signals: JointSignals
) -> ChannelFailure:
    squares = e.error**2
    total = max(float(np.sum(squares)), 1e-300)
    inside = {name: np.any(mask, axis=1) for name, mask in masks.items()}
    inside = {name: mask for name, mask in inside.items() if np.sum(mask) >= FEWEST}
    standstill = regimes.at(e.separate_times)["standstill"][:, 0]
    test = whiteness(np.where(standstill, np.nan, e.separate))
    return ChannelFailure(
        error=e.rms / e.sigma,
        regimes={name: float(np.sqrt(np.mean(squares[mask]))) / e.sigma for name, mask in inside.items()},
        regime_share={name: float(np.sum(squares[mask])) / total for name, mask in inside.items()},
        joint_of_regime={name: _joint_of(name, squares, masks[name], joints) for name in inside},
        autocorrelation=test.autocorrelation,
        whiteness_p=test.p,
        correlations=signals.correlations(e.times, e.error),
        floor=e.floor / e.sigma,
        windows=_windows(e),
    )


def _joint_of(regime: str, squares: Array, mask: Mask, joints: tuple[str, ...]) -> str:
    """The joint in whose regime the mean squared error is largest."""
    if regime in WHOLE_ROBOT:
        return ""
    means = [np.mean(squares[column]) if np.sum(column) >= FEWEST else -1.0 for column in mask.T]
    return joints[int(np.argmax(means))]


def _windows(e: ChannelErrors) -> tuple[FailureWindow, ...]:
    """The stretches with the largest shares."""
    t0 = float(e.times[0])
    index = ((e.times - t0) / WINDOW).astype(int)
    sums, counts = np.bincount(index, e.error**2), np.bincount(index)
    total = max(float(np.sum(sums)), 1e-300)
    return tuple(
        FailureWindow(
            t0 + float(i) * WINDOW,
            t0 + float(i + 1) * WINDOW,
            float(np.sqrt(sums[i] / counts[i])) / e.sigma,
            float(sums[i]) / total,
        )
        for i in np.argsort(-sums)[:WORST]
        if counts[i]
    )
