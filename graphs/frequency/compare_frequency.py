# SPDX-License-Identifier: BSD-3-Clause
"""How far a model's response is from the measured one, entry by entry and line by line, beside what noise makes.

The matrix of the model takes dry friction for what it seems under the motion that carries the excitation; the torque
balance knows it as it is, and says how much of the torques the model does not explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.explained import PoseFit, pose_fit
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.frequency.stages import first_stage, next_stage
from jointscope.graphs.responses.neighbouring_lines import NEIGHBOURS
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.signals import Excitation, Signals

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
DECIBEL = 20.0 / np.log(10.0)  # of a natural logarithm


@dataclass(frozen=True)
class FrequencyErrors:
    """A model in one pose.

    Attributes:
        pose: what was measured.
        model: its response from torques to positions at the lines that are used, shape (l, nu, nu).
        fit: what its torque balance leaves.
    """

    pose: ShakenPose
    model: Complex
    fit: PoseFit

    @property
    def measured(self) -> Complex:
        """The response at the same lines."""
        return np.asarray(self.pose.matrix.G[self.pose.used])

    @property
    def spread(self) -> Array:
        """Sigma of the measured entries, of noise and distortion, in the complex plane, shape (l, nu, nu)."""
        m = self.pose.matrix
        return m.sigmas(m.total)[self.pose.used]

    @property
    def decibel(self) -> Array:
        """Size of the model's entries over the measured ones, shape (l, nu, nu) [dB]."""
        return np.asarray(DECIBEL * np.log(np.abs(self.model) / np.abs(self.measured)))

    @property
    def floor_decibel(self) -> Array:
        """What the spread of the measured entries alone would make of it, one sigma, shape (l, nu, nu) [dB]."""
        return np.asarray(DECIBEL * self.spread / np.abs(self.measured) / np.sqrt(2.0))

    @property
    def sigmas(self) -> Array:
        """Distance in the complex plane in sigmas of the measured entries, shape (l, nu, nu)."""
        return np.asarray(np.abs(self.model - self.measured) / self.spread)

    @property
    def logarithm(self) -> Array:
        """Size of the logarithm of model over measured, shape (l, nu, nu)."""
        return np.asarray(np.abs(np.log(self.model / self.measured)))


def frequency_errors(robot: Robot, recordings: Sequence[tuple[Signals, Excitation]]) -> tuple[FrequencyErrors, ...]:
    """A model in each pose, at its own values.

    Raises:
        RecordingError: a recording shows no response.
    """
    at = Calibration.of(robot).only([DYNAMICS])
    found = []
    for recording in recordings:
        problem = first_stage(robot, ShakenPose.of(*recording))
        model = problem.response(problem.values(at))
        while problem.stage.logarithm or problem.stage.width > NEIGHBOURS:
            problem = next_stage(problem, at)
        found.append(FrequencyErrors(problem.pose, model, pose_fit(problem, at)))
    return tuple(found)


def entries(poses: Sequence[FrequencyErrors]) -> dict[str, dict[str, float]]:
    """Root mean squares of each entry over lines and poses, by "output,input" counted from 1."""
    parts = ("rms_log", "logarithm"), ("db", "decibel"), ("floor_db", "floor_decibel"), ("sigmas", "sigmas")
    size = {key: _rms([getattr(pose, part) for pose in poses]) for key, part in parts}
    places = np.ndindex(size["db"].shape)
    return {f"{i + 1},{j + 1}": {key: float(value[i, j]) for key, value in size.items()} for i, j in places}


def errors_json(poses: Sequence[FrequencyErrors]) -> dict[str, Any]:
    """What JSON says of a model: `frequency` of `compare`."""
    by_entry = entries(poses)
    whole = float(np.sqrt(np.mean([entry["rms_log"] ** 2 for entry in by_entry.values()])))
    return {
        "rms_log": whole,
        "entries": {key: entry["rms_log"] for key, entry in by_entry.items()},
        "matrix": by_entry,
        "lines": {
            pose.pose.path: {
                "frequencies": (pose.pose.w / (2.0 * np.pi)).tolist(),
                "db": pose.decibel.tolist(),
                "floor_db": pose.floor_decibel.tolist(),
                "sigmas": pose.sigmas.tolist(),
            }
            for pose in poses
        },
        "balance": {
            pose.pose.path: {
                "left": pose.fit.left.tolist(),
                "over_noise": None if pose.fit.over_noise is None else pose.fit.over_noise.tolist(),
            }
            for pose in poses
        },
    }


def _rms(parts: Sequence[Array]) -> Array:
    return np.asarray(np.sqrt(np.mean(np.concatenate([np.square(part) for part in parts]), axis=0)))
