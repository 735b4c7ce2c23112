# SPDX-License-Identifier: BSD-3-Clause
"""Is this calibration good? Checks with limits, each with a sentence, and the verdict that follows from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.calibration.found_values import share_of_value
from jointscope.graphs.noise.robust_sigma import BLOCK, FEWEST_BLOCKS
from jointscope.robots.geometry.error_parameters import is_geometry
from jointscope.robots.parts.relative_sigma import NOT_DETERMINED, relative_sigma
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.verdicts.currents_and_volts import currents_and_volts
from jointscope.tools.verdicts.given_recordings import given
from jointscope.tools.verdicts.missing_effects import missing_effects
from jointscope.tools.verdicts.plausible_torques import plausible_torques
from jointscope.tools.verdicts.priors.far_from_priors import NAME as AS_EXPECTED_BY_PRIORS
from jointscope.tools.verdicts.priors.far_from_priors import far_from_priors
from jointscope.tools.verdicts.priors.held_values import UNDETERMINED, is_mounting_or_bias, values_from_data
from jointscope.tools.verdicts.rests.beside_motion import rests_agree
from jointscope.tools.verdicts.same_time import same_time
from jointscope.tools.verdicts.same_values import same_by_regression, same_values
from jointscope.tools.verdicts.short_steps import short_steps
from jointscope.tools.verdicts.torque_constants import suspicious_constants
from jointscope.tools.verdicts.whiteness import AS_EXPECTED, LAGS, channel_memory, endless_torque, strength

LEVELS = ("good", "info", "warn", "bad")
ANSWERS = {
    "good": "Yes, this calibration is good.",
    "warn": "Usable, with reservations.",
    "bad": "No, do not rely on this calibration yet.",
}
CHI2 = (AS_EXPECTED, 2.0)  # mean square of a channel's residual in sigmas: fine up to the first, bad beyond the second
TOO_SMALL = 0.4  # mean square of a channel's residual in sigmas below which its sigma is too large
CORRELATION = (0.25, 0.5)  # largest autocorrelation within LAGS; a quantized encoder at rest reaches 0.2
UNEXPLAINED = (0.02, 0.2)  # share of a velocity that the dynamics leave open after DRIFT, in the worst window
DRIFT = 0.1  # [s]
INFLATION = (3.0, 20.0)  # sigmas from blocks against those of white noise
TOGETHER = 2  # doubtful signs of the residuals that make an answer worthless
WEAK = 0.1  # relative sigma of a direction that makes its parameters doubtful


@dataclass(frozen=True)
class Check:
    """One question, its answer as a level of LEVELS, and a sentence."""

    level: str
    name: str
    text: str


@dataclass(frozen=True)
class Judgement:
    """Verdict of all checks: level, headline, and the checks."""

    level: str
    headline: str
    checks: tuple[Check, ...]

    @staticmethod
    def of(checks: Sequence[Check], answers: Mapping[str, str] = ANSWERS) -> Judgement:
        """The verdict that follows from some checks, the worst of them, with its headline from `answers`."""
        worst = max((LEVELS.index(check.level) for check in checks), default=0)
        level = LEVELS[worst] if worst >= LEVELS.index("warn") else "good"
        return Judgement(level, answers[level], tuple(checks))

    @property
    def doubts(self) -> tuple[Check, ...]:
        """The checks that speak against the result."""
        return tuple(check for check in self.checks if check.level in ("warn", "bad"))

    @property
    def answer(self) -> str:
        """The headline, and below it a line for each doubt."""
        return "\n".join([self.headline, *(f"  ! {check.name}? {check.text}" for check in self.doubts)])

    def to_json(self) -> dict[str, Any]:
        """The verdict and every check that was made, for machines."""
        return {
            "verdict": {"level": self.level, "text": self.headline},
            "checks": [{"name": c.name, "verdict": c.level, "why": c.text} for c in self.checks],
        }


def judge(result: CalibrationResult) -> Judgement:
    """Applies all checks to a calibration."""
    plausible, timing, missing = plausible_torques(result), same_time(result), missing_effects(result)
    (held, steps), reasons = (values_from_data(result), short_steps(result)), given(result)
    about_values = [
        Check(steps[0], "Steps short enough", steps[1]),
        _determined(result),
        Check(held[0], "Values from data, not from priors", held[1]),
    ]
    far = far_from_priors(result)
    signs = (_noise_as_stated(result), _white(result), *([] if result.robot.free_links else [_even(result)]))
    checks = (
        *(Check("bad", name, text) for name, text in reasons),
        *signs,
        *_agreeing(signs),
        *(_consequences(about_values) if reasons else about_values),
        Check(far[0], AS_EXPECTED_BY_PRIORS, far[1]),
        _honest_sigmas(result),
        Check(timing[0], "Drive signal and sensors at the same time", timing[1]),
        Check(*same_by_regression(result)),
        *(Check(*each) for each in same_values(result)),
        *(Check(*each) for each in rests_agree(result)),
        *(Check(*each) for each in currents_and_volts(result)),
        _constants(result),
        Check(plausible[0], "Masses and torques that go together", plausible[1]),
        Check(missing[0], "Values that no missing effect would change", missing[1]),
    )
    return Judgement.of(checks)


def _consequences(checks: Sequence[Check]) -> list[Check]:
    """Checks of values that no model could have found: their advice would mend nothing."""
    told = (
        "That cannot be judged as long as drives saturate, a tracker is late or moves, a load changes, something "
        "pushes, or samples are too rare."
    )
    return [Check("info", check.name, told) if check.level in ("warn", "bad") else check for check in checks]


def _agreeing(signs: Sequence[Check]) -> list[Check]:
    """A check that fails where several signs say that the model lacks something; none where at most one does.

    Each alone may be a sensor that is noisier than stated, or random torques that a sigma includes. Together they are
    neither: what is missing has a shape in time that no sigma holds, and values take it for themselves.
    """
    doubtful = [sign.name for sign in signs if sign.level == "warn"]
    if len(doubtful) < TOGETHER:
        return []
    text = (
        f"{' and '.join(f'“{name}”' for name in doubtful)} are doubtful at once: what is missing is not noise, and "
        "the sigmas do not include it. `jointscope diagnose` says what it may be."
    )
    return [Check("bad", "No two signs that something is missing", text)]


def _noise_as_stated(result: CalibrationResult) -> Check:
    name = "Residuals as large as the sensor noise"
    if not result.channels:
        return Check("info", name, "There are no channels to check.")
    chi2s = {c: f.chi2 for c, f in result.channels.items()}
    worst = max(chi2s, key=lambda c: chi2s[c])
    smallest = min(chi2s, key=lambda c: chi2s[c])
    level = _level(chi2s[worst], CHI2)
    if level == "good" and chi2s[smallest] < TOO_SMALL:
        # a sigma that was taken too large does no harm to the values
        text = f"{smallest} has χ² per sample {significant(chi2s[smallest])}: its noise is smaller than its sigma."
        return Check("info", name, text)
    if level == "good":
        low, high = min(f.chi2 for f in result.channels.values()), max(f.chi2 for f in result.channels.values())
        return Check(level, name, f"χ² per sample is {low:.2f} to {high:.2f} over all channels; 1 is expected.")
    count = sum(chi2 > CHI2[0] for chi2 in chi2s.values())
    return Check(
        level,
        name,
        f"{worst} has χ² per sample {significant(chi2s[worst])} (1 is expected): the model misses something there, or "
        f"its noise is larger than stated. {count} of {len(chi2s)} channels are off.",
    )


def _white(result: CalibrationResult) -> Check:
    found: dict[str, float] = {}
    for bag in result.bags:
        for channel, value in channel_memory(bag, result.robot).items():
            found[channel] = max(found.get(channel, 0.0), value)
    if not found:
        return Check("info", "Residuals without memory", "There are no residuals to check.")
    if lasting := endless_torque(result):
        return Check("bad", "Residuals without memory", lasting)
    levels = {c: _colour_level(value, result.channels[c].chi2) for c, value in found.items()}
    worst = max(found, key=lambda c: (LEVELS.index(levels[c]), found[c]))
    level = levels[worst]
    tail = "nothing systematic is left" if level == "good" else "something systematic is left in it"
    text = f"The largest autocorrelation over {LAGS} samples is {found[worst]:.2f}, in {worst}: {tail}."
    return Check(level, "Residuals without memory", text)


def _colour_level(correlation: float, chi2: float) -> str:
    """Residuals far below the noise of their sensor may have a memory without doing much harm."""
    level = _level(correlation, CORRELATION)
    return "warn" if level == "bad" and chi2 < TOO_SMALL else level


def _even(result: CalibrationResult) -> Check:
    """The worst window in practical size: with many samples every deviation is significant, few matter."""
    layout, drift = result.robot.layout, result.noise.drift(DRIFT)
    k, lasting = len(drift), layout.n_rates - len(drift) if result.noise.n_lasting else 0
    worst, where, when = 0.0, "", 0.0
    for bag in result.bags:
        edges, rms = strength(bag.ticks[:-1], bag.process / bag.process_sigma)
        rms = np.maximum(rms[:, :k], rms[:, lasting : lasting + k])  # what is missing shows in either
        size = np.sqrt(np.mean(bag.states[:, layout.velocities] ** 2, axis=0))
        share = rms * drift / np.where(size > 0, size, np.inf)
        at, i = np.unravel_index(int(np.nanargmax(share)), share.shape)
        if share[at, i] > worst:
            worst, where, when = float(share[at, i]), equation_names(result)[i], float(edges[at])
    tail = "." if (level := _level(worst, UNEXPLAINED)) == "good" else ": an effect may be missing that acts there."
    text = (
        f"At its worst ({where} equation, around {when:.1f} s) the dynamics leave {significant(100 * worst, 2)} % of "
        f"the velocity open after {DRIFT:g} s{tail}"
    )
    return Check(level, "Dynamics hold throughout", text)


def _determined(result: CalibrationResult) -> Check:
    name = "Every parameter determined by the motion"
    open_by = _typically_open(result)
    if open_by > UNDETERMINED:
        spread = relative_sigma(open_by, "±")
        known = spread if spread == NOT_DETERMINED else f"only known to {spread}"
        return Check(
            "bad",
            name,
            f"Typical values are {known}: the recording determines their ratios at best. Hold one that you know with "
            "`fixed: true` in the robot file, or record more.",
        )
    weak = [d for d in result.weak_directions if not all(_is_sensor_name(p) for p in d.weights)]
    if weak:
        return Check("warn" if weak[0].sigma > WEAK else "info", name, weak[0].text)
    if result.weak_directions:
        return Check("info", name, f"All dynamic parameters are, but: {result.weak_directions[0].text}")
    return Check("good", name, "No combination of parameters is weakly determined.")


def _typically_open(result: CalibrationResult) -> float:
    """Median relative sigma of the dynamic parameters."""
    free = [p for p in result.parameters if not (is_mounting_or_bias(p) or is_geometry(p.name)) and p.value]
    free = [p for p in free if p.unit not in ("s", "s^2")]
    shares = [share for p in free if (share := share_of_value(result.robot, p)) is not None]
    return float(np.median(shares)) if shares else 0.0


def _honest_sigmas(result: CalibrationResult) -> Check:
    name = "Sigmas that can be trusted"
    if not result.sigma_inflation:
        return Check("info", name, "They assume white noise; no comparison with blocks of the recording was made.")
    worst = max(result.sigma_inflation, key=lambda p: result.sigma_inflation[p])
    factor = result.sigma_inflation[worst]
    level = _level(factor, INFLATION)
    if result.recording_seconds < BLOCK * FEWEST_BLOCKS:
        return Check("info", name, "The recording is too short to compare blocks of it; they assume white noise.")
    if factor <= 1.05:
        return Check(level, name, "Blocks of the recording scatter no more than white noise would.")
    return Check(
        level,
        name,
        f"Blocks of the recording scatter up to {significant(factor, 2)} times more than white noise "
        f"would ({worst}); the sigmas shown include it.",
    )


def _constants(result: CalibrationResult) -> Check:
    doubt = suspicious_constants(result)
    name = "Torque constants like those of drives"
    return (
        Check("bad", name, doubt) if doubt else Check("good", name, "Nothing speaks against the unit of the command.")
    )


def equation_names(result: CalibrationResult) -> list[str]:
    """Names of the columns of BagFit.process without those of memories."""
    layout = result.robot.layout
    return [f"{name} link" for name in layout.links] + [f"{name} motor" for name in layout.motors]


def largest_relative_sigma(result: CalibrationResult) -> tuple[str, float]:
    """The dynamic parameter with the largest sigma relative to its value, and that share; times have none."""
    told = [p for p in result.parameters if p.value and p.unit not in ("s", "s^2") and not is_mounting_or_bias(p)]
    shares = {p.name: share for p in told if (share := share_of_value(result.robot, p)) is not None}
    if not shares:
        return "", float("nan")
    worst = max(shares, key=lambda name: shares[name])
    return worst, shares[worst]


def _is_sensor_name(name: str) -> bool:
    return ".R_imu_body" in name or ".rotation" in name or ".bias" in name


def _level(value: float, limits: tuple[float, float]) -> str:
    if not np.isfinite(value):
        return "bad"
    return "good" if value <= limits[0] else "warn" if value <= limits[1] else "bad"
