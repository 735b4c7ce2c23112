# SPDX-License-Identifier: BSD-3-Clause
"""Whether shaken poses are explained: what the torque balance leaves, and whether recordings tell the same values.

Three questions, none of which the covariance of the estimate answers, for it takes what is left for noise:

- is what is left as large as the noise, which changes from period to period?
- does it answer the excitation? D = r U^-1, motors by motors, is what the model lacks of dynamic stiffness. Noise and
  friction make another one under other phases and at the next line; a mode that is missing makes the same one. The
  share of the power that comes again is the sum of D1 D2* over that of |D|^2, zero with sigma 1 / sqrt(2 n).
- do poses, and realisations of the phases, tell the same values, and do the others predict what a realisation leaves?
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.agreement import Agreement, agreement
from jointscope.graphs.frequency.frequency_set import FrequencySet
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.responses.neighbouring_lines import over_neighbours
from jointscope.robots.files.sections.frequency_section import COULOMB
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Key = TypeVar("Key")
BANDS = 10  # of frequency, with as many lines each


@dataclass(frozen=True)
class Answered:
    """How much of what is left answers the excitation, in a band.

    Attributes:
        low, high: ends of the band [Hz].
        share: of its power.
        sigma: of the share, were it noise.
    """

    low: float
    high: float
    share: float
    sigma: float


@dataclass(frozen=True)
class PoseFit:
    """What the balance of a pose leaves.

    Attributes:
        path: of the bag.
        left: share of each motor's torque, rms, shape (nu,).
        over_noise: its power over that of the noise, each motor, shape (nu,); None with one period.
        answered: band by band.
        by_realisations: whether `answered` compares realisations; else neighbouring lines, as there is one.
    """

    path: str
    left: Array
    over_noise: Array | None
    answered: tuple[Answered, ...]
    by_realisations: bool


@dataclass(frozen=True)
class Explained:
    """Whether the poses are explained.

    Attributes:
        poses: one by one.
        between_poses: each pose against the others, by its path; empty with one pose.
        between_realisations: each realisation against the others, by its number; empty with one.
        heldout: rms of the whitened residuals of each realisation, as the others predict it.
        fitted: the same with all of them in the fit.
    """

    poses: tuple[PoseFit, ...]
    between_poses: dict[str, Agreement]
    between_realisations: dict[int, Agreement]
    heldout: dict[int, float]
    fitted: dict[int, float]

    def to_json(self) -> dict[str, Any]:
        """For machines."""
        tests = {**self.between_poses, **{f"realisation {n}": test for n, test in self.between_realisations.items()}}
        return {
            "poses": {
                pose.path: {
                    "left": pose.left.tolist(),
                    "over_noise": None if pose.over_noise is None else pose.over_noise.tolist(),
                    "answered": [vars(band) for band in pose.answered],
                    "answered_from": "realisations" if pose.by_realisations else "neighbouring lines",
                }
                for pose in self.poses
            },
            "agreement": {key: {"chi2": t.chi2, "dof": t.dof, "p_value": t.p_value} for key, t in tests.items()},
            "heldout": {str(n): {"error": e, "fitted": self.fitted[n]} for n, e in self.heldout.items()},
        }


def explained(robot: Robot, problems: Sequence[FrequencySet]) -> Explained:
    """Asks poses at their last stage.

    Args:
        robot: with the values that were found; its priors hold what the recordings do not tell.
        problems: the poses.
    """
    at = Calibration.of(robot).only([DYNAMICS])
    poses = tuple(pose_fit(problem, at) for problem in problems)
    paths = [problem.pose.path for problem in problems]
    alone = {path: [problem] for path, problem in zip(paths, problems, strict=True)}
    numbers = sorted({int(r) for problem in problems for r in problem.pose.found.realisations})
    parts = {r: [part for problem in problems if (part := _realisation(problem, r)) is not None] for r in numbers}
    if len(numbers) < 2:
        return Explained(poses, _against_others(robot, alone, at), {}, {}, {})
    fitted = {r: _error(part, at) for r, part in parts.items()}
    heldout = {r: _error(part, at, _from_others(robot, parts, r, at)) for r, part in parts.items()}
    return Explained(poses, _against_others(robot, alone, at), _against_others(robot, parts, at), heldout, fitted)


def pose_fit(problem: FrequencySet, at: Calibration) -> PoseFit:
    """What the balance of a pose leaves at some values."""
    pose, values = problem.pose, problem.values(at)
    r = problem.torque_balance(values, problem.stiffness(values))
    left = np.sqrt(np.mean(np.abs(r) ** 2, axis=(0, 1)) / np.mean(np.abs(pose.torques) ** 2, axis=(0, 1)))
    noise = None
    if pose.found.periods > 1:
        noise = np.mean(np.mean(np.abs(r) ** 2, axis=0) / _noise(problem, values), axis=0)
    whitened, own, _ = problem.balance(values)
    rows = whitened(own[None])[:, :, 0].reshape(len(pose.lines), own.shape[2], own.shape[0])
    D = _lacking(rows, np.moveaxis(pose.torques, 0, 2), pose.found.blocks)
    return PoseFit(pose.path, left, noise, _answered(D, pose.w / (2.0 * np.pi)), len(D) > 1)


def _noise(problem: FrequencySet, values: dict[str, float]) -> Array:
    """Variance of the balance by what changes from period to period, shape (l, nu)."""
    Z = problem.with_friction(problem.stiffness(values).Z, values)
    torques, positions, friction = problem.pose.changes(problem.sharpness(values))
    dry = np.array([values.get(f"{joint}.{COULOMB}", 0.0) for joint in problem.arm.joints])
    changed = np.einsum("lij,selj->seli", Z, positions) + dry * friction - torques
    each = np.mean(np.sum(np.abs(changed) ** 2, axis=0), axis=0)
    return np.asarray(over_neighbours(each[:, :, None].astype(complex))[:, :, 0].real)


def _lacking(r: Complex, U: Complex, blocks: Sequence[NDArray[np.intp]]) -> Complex:
    """What residuals, shape (l, nu, e), are of torques, in units of residuals, shape (realisations, l, nu, nu)."""
    found = []
    for block in blocks:
        given = U[:, :, block]
        size = np.sqrt(np.mean(np.abs(given) ** 2, axis=(1, 2)))
        found.append(r[:, :, block] @ np.linalg.pinv(given) * size[:, None, None])
    return np.array(found)


def _answered(D: Complex, f: Array) -> tuple[Answered, ...]:
    found = []
    for band in np.array_split(np.arange(len(f)), min(BANDS, max(len(f) // 2, 1))):
        x = D[:, band]
        power, R = float(np.sum(np.abs(x) ** 2)), len(x)
        if R > 1:
            share = (float(np.sum(np.abs(x.sum(axis=0)) ** 2)) - power) / ((R - 1) * power)
            count = x[0].size * R * (R - 1) / 2.0
        else:
            share = float(np.real(np.sum(x[:, 1:] * x[:, :-1].conj()))) / power * len(band) / max(len(band) - 1, 1)
            count = max(x.size - x[:, 0].size, 1)
        found.append(Answered(float(f[band[0]]), float(f[band[-1]]), share, float(1.0 / np.sqrt(2.0 * count))))
    return tuple(found)


def _realisation(problem: FrequencySet, number: int) -> FrequencySet | None:
    """The experiments of one realisation alone; None where the pose has none of it."""
    pose, stage = problem.pose, problem.stage
    own = np.flatnonzero(pose.found.realisations == number)
    if not len(own):
        return None
    found, excitation = pose.found, pose.found.excitation
    kept = tuple(e for e in excitation.experiments if e.realisation == number)
    part = replace(
        found,
        excitation=replace(excitation, experiments=kept),
        U=found.U[own],
        Y=found.Y[own],
        common=None if found.common is None else found.common[own],
        realisations=found.realisations[own],
    )
    assert stage.friction is not None
    size, sharper = stage.friction
    shift = stage.shift[own] if isinstance(stage.shift, np.ndarray) else stage.shift
    geometry = {name: column[own] for name, column in stage.geometry.items()}
    more = stage.sharper[own] if isinstance(stage.sharper, np.ndarray) else stage.sharper
    now = replace(stage, friction=(size[own], sharper[own]), shift=shift, geometry=geometry, x=None, sharper=more)
    return replace(problem, pose=replace(pose, found=part), stage=now)


def _against_others(robot: Robot, parts: dict[Key, list[FrequencySet]], at: Calibration) -> dict[Key, Agreement]:
    """Each part against all others, in coordinates of unit prior variance."""
    if len(parts) < 2:
        return {}
    summaries = {key: FrequencySummary.of(part, at, apart=True) for key, part in parts.items()}
    unit = np.array([robot.parameters[name].coordinate_sigma for name in at.names])
    prior = _prior(robot, at)
    found = {}
    for key, own in summaries.items():
        others = [summary for other, summary in summaries.items() if other != key]
        found[key] = agreement(*(_told(part, unit, prior) for part in ([own], others)))
    return found


def _told(summaries: Sequence[FrequencySummary], unit: Array, prior: Array) -> tuple[Array, Array]:
    """Posterior mean and information of some recordings in coordinates of unit prior variance."""
    A = np.sum([s.information for s in summaries], axis=0) * np.outer(unit, unit)
    pull = unit * np.sum([s.information @ (s.preferred - prior) for s in summaries], axis=0)
    return np.linalg.solve(np.eye(len(A)) + A, pull), A


def _prior(robot: Robot, at: Calibration) -> Array:
    """Coordinates of the priors' means, shape (p,)."""
    parameters = [robot.parameters[name] for name in at.names]
    return np.array([np.log(p.prior) if p.positive else p.prior for p in parameters])


def _from_others(robot: Robot, parts: dict[int, list[FrequencySet]], number: int, at: Calibration) -> Array:
    """Step to the values that all other realisations tell, shape (p,)."""
    summaries = [FrequencySummary.of(part, at, apart=True) for r, part in parts.items() if r != number]
    unit, prior = np.array([robot.parameters[name].coordinate_sigma for name in at.names]), _prior(robot, at)
    return np.asarray(prior + unit * _told(summaries, unit, prior)[0] - at.dynamics)


def _error(part: Sequence[FrequencySet], at: Calibration, step: Array | None = None) -> float:
    """Rms of the whitened residuals, or of what they are to first order a step away."""
    rows = [problem.rows(at) for problem in part]
    left = np.concatenate([(r if step is None else r + J @ step).ravel() for r, J in rows])
    return float(np.sqrt(np.mean(left**2)))
