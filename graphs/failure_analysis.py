# SPDX-License-Identifier: BSD-3-Clause
"""Where and when a model fails: per channel, regime of motion, and against the signals that drive the robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

REGIMES = ("standstill", "reversal", "fast", "loaded", "near limits", "other")


@dataclass(frozen=True)
class ChannelFailure:
    """How one channel fails.

    Attributes:
        error: root mean square of the 0.1 s ahead prediction error [sensor sigma].
        regimes: the same within each regime that occurs, by name of REGIMES.
        regime_share: part of the channel's squared error that falls into each regime.
        joint_of_regime: for each regime, the joint whose motion defines it best (largest error), or "".
        autocorrelation: of the residuals of the one-step predictions at lag one.
        whiteness_p: Ljung-Box p-value of those residuals.
        correlations: correlation of the prediction error with signals ("joint1.velocity", "joint1.sign(velocity)",
            "joint1.position", "joint1.deflection", "joint1.load", "joint1.command"), by name.
    """

    error: float
    regimes: Mapping[str, float]
    regime_share: Mapping[str, float]
    joint_of_regime: Mapping[str, str]
    autocorrelation: float
    whiteness_p: float
    correlations: Mapping[str, float]


@dataclass(frozen=True)
class FailureAnalysis:
    """Where a model fails in one recording.

    Attributes:
        channels: by channel, worst first.
        time_in_regime: share of the recording spent in each regime.
        sentences: what this means, in plain words, worst first ("Gyro 1 sees 0.2 rad/s about its x axis where the
            model allows none, most of it when joint 2 reverses").
    """

    channels: Mapping[str, ChannelFailure]
    time_in_regime: Mapping[str, float]
    sentences: tuple[str, ...]
