# SPDX-License-Identifier: BSD-3-Clause
"""Correlation of prediction errors with what the joints do: position, velocity, its sign, deflection, load, command.

All signals but the command are predicted, never measured: a measured signal shares noise with the error. They are
predicted 0.01 s ahead, where the error itself has hardly entered them. An error has grown over the 0.1 s of its
prediction, so each signal is tried at several delays and the strongest correlation counts.
A command comes from feedback on measured angles; that it correlates proves nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.problem.joint_states import JointStates
from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

DELAYS = (0.0, 0.02, 0.04, 0.06, 0.08, 0.1)  # [s] of a signal before the end of the prediction


class JointSignals:
    """Signals of all joints, ready to be correlated with errors at any times.

    Args:
        joints: names of the n joints.
        motion: predicted motion.
        command: commands, shape (k, n).
        still: speed of each joint below which the sign of its velocity counts as zero, shape (n,) [rad/s].
    """

    def __init__(self, joints: tuple[str, ...], motion: JointStates, command: Stream, still: Array):
        self._joints, self._motion, self._command, self._still = joints, motion, command, still

    def at(self, times: Array) -> dict[str, Array]:
        """Every signal by name ("joint1.sign(velocity)"), shape (m,)."""
        motion = self._motion.at(times)
        held = np.clip(np.searchsorted(self._command.times, times, side="right") - 1, 0, None)
        kinds = {
            "position": motion.q,
            "velocity": motion.v,
            "sign(velocity)": np.where(np.abs(motion.v) > self._still, np.sign(motion.v), 0.0),
            "deflection": motion.deflection,
            "load": motion.load,
            "command": self._command.values[held],
        }
        return {f"{joint}.{kind}": part[:, j] for kind, part in kinds.items() for j, joint in enumerate(self._joints)}

    def correlations(self, times: Array, error: Array) -> Mapping[str, float]:
        """Correlation with each signal, largest size over the delays, strongest first.

        Args:
            times: of the errors, shape (m,) [s].
            error: shape (m,).
        """
        best: dict[str, float] = {}
        for delay in DELAYS:
            signals = self.at(times - delay)
            values = np.column_stack(list(signals.values()))
            for name, r in zip(signals, _correlation(values, error), strict=True):
                if np.isfinite(r) and abs(r) > abs(best.get(name, 0.0)):
                    best[name] = float(r)
        return dict(sorted(best.items(), key=lambda item: -abs(item[1])))


def _correlation(values: Array, error: Array) -> Array:
    """Correlation of each column with the error; NaN for unknown or constant columns."""
    centred, e = values - np.mean(values, axis=0), error - np.mean(error)
    size = np.linalg.norm(centred, axis=0) * np.linalg.norm(e)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(size > 0.0, centred.T @ e / size, np.nan)
