# SPDX-License-Identifier: BSD-3-Clause
"""What a calibration tells the user in words: is it good, what is weak, what looks wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.calibration.found_values import share_of_value
from jointscope.graphs.noise.torque_memory import MEMORIES
from jointscope.robots.geometry.error_parameters import is_geometry
from jointscope.robots.model.lasting_torques import lasting_torques
from jointscope.robots.parts.relative_sigma import NOT_DETERMINED, relative_sigma
from jointscope.robots.parts.sensors import LinkEncoder, MotorEncoder
from jointscope.robots.recordings.recording import Notice

CHI2_LOW, CHI2_HIGH = 0.6, 1.25  # mean squared residual in sigmas that agrees with the stated sensor noise
COLOURED = 1.5  # block-robust over plain sigma from which a value counts as widened
FELL = 0.5  # of a sigma, below which it is not believed that the noise is so small
SAID = 0.2  # relative change of a sigma that is told
SEVERAL = 0.25  # share of widened values from which residuals are called coloured; a few widen by chance


def findings(result: CalibrationResult, notices: Sequence[Notice] = ()) -> tuple[str, ...]:
    """Sentences, most important first.

    Args:
        result: a calibration without findings.
        notices: what the screening saw.
    """
    said = [*_not_at_rest(result), *_isolated(result), _verdict(result), *_lasting(result)]
    said += [*_unsettled(result), *_sensor_noise(result), *_other_sigmas(result), *_process_noise(result)]
    said += _coloured(result)
    said += [direction.text for direction in result.weak_directions]
    said += [f"{p.name}: {p.note}" for p in result.parameters if p.note and "prior" not in p.note]
    said += [notice.text for notice in notices]
    return tuple(said)


def _not_at_rest(result: CalibrationResult) -> list[str]:
    if result.converged:
        return []
    worst, fit = max(result.channels.items(), key=lambda item: item[1].chi2)
    return [
        f"the model contradicts the recordings (residuals of {np.sqrt(fit.chi2):.2g} sigma on {worst}): nothing was "
        "gained any more although values still moved; believe no value and no sigma before the missing effect is in "
        "the model: jointscope diagnose"
    ]


def _unsettled(result: CalibrationResult) -> list[str]:
    if not result.unsettled:
        return []
    return [
        f"the iterations ended with a last step of {result.unsettled:.1g} sigma: states where joints turn over still "
        "moved, the values did not"
    ]


def _other_sigmas(result: CalibrationResult) -> list[str]:
    """Encoders whose sigma the calibration found to be another one."""
    said = []
    for name, before in result.start.sensors.items():
        if not isinstance(before, MotorEncoder | LinkEncoder):
            continue
        now = result.robot.sensors[name].sigmas
        changed = [
            f"{channel} {new:.3g} {unit} (was {old:.3g})"
            for channel, unit, old, new in zip(before.channels, before.units, before.sigmas, now, strict=True)
            if abs(np.log(new / old)) > np.log(1.0 + SAID)
        ]
        fell = bool(np.any(now < FELL * before.sigmas))
        far = (
            " (so small, the states may follow the noise, as those of a model that lacks something do)" if fell else ""
        )
        if changed:
            said.append(
                f"its residuals are of another size than stated, so these sigmas were found anew: "
                f"{', '.join(changed)}; `estimate_sigma: false` in sensors.{name} keeps yours{far}"
            )
    return said


def _isolated(result: CalibrationResult) -> list[str]:
    return [moment.sentence(bag.recording) for bag in result.bags for moment in bag.isolated]


def _verdict(result: CalibrationResult) -> str:
    dynamics = [p for p in result.parameters if p.name in result.robot.parameters]
    count = len(dynamics)
    # how well a time is known shows in seconds, not in shares of a delay that may be none
    dynamics = [p for p in dynamics if p.value and p.unit not in ("s", "s^2") and not is_geometry(p.name)]
    shares = {p.name: share for p in dynamics if (share := share_of_value(result.robot, p)) is not None}
    relative = list(shares.values())
    if not relative:
        return "no parameter was free"
    worst = max(shares, key=lambda name: shares[name])
    typical = float(np.median(relative))
    least = relative_sigma(max(relative))
    return (
        f"{count} parameters from {result.samples:,} samples: typically {relative_sigma(typical)}, "
        f"worst {worst}{', ' if least == NOT_DETERMINED else ' with '}{least}"
    )


AS_STATED = "every sensor channel is explained down to its stated noise"
"""Said of residuals alone; beside a verdict of "No" it would say that the model were right."""


def _sensor_noise(result: CalibrationResult) -> list[str]:
    odd = {name: fit.chi2 for name, fit in result.channels.items() if not CHI2_LOW < fit.chi2 < CHI2_HIGH}
    if not odd:
        return [AS_STATED]
    listed = ", ".join(f"{name} ({np.sqrt(chi2):.2g} sigma)" for name, chi2 in odd.items())
    too_large = any(chi2 > CHI2_HIGH for chi2 in odd.values())
    reason = (
        "the model lacks something that these channels see, or their sigma in the robot file is too small"
        if too_large
        else "smaller than stated, as that of a quantized encoder at rest, or the states follow the noise"
    )
    return [f"residuals do not have the stated size on {listed}: {reason}"]


def _process_noise(result: CalibrationResult) -> list[str]:
    """How much unexplained torque the noise stands for, against what the motors do."""
    robot, said = result.robot, []
    if robot.free_links:
        return []
    drifts = result.noise.drift(0.1)
    bag = result.bags[0]
    layout = robot.layout
    v = bag.states[:, layout.velocities]
    for j, side in enumerate([f"{name} link" for name in layout.links] + [f"{name} motor" for name in layout.motors]):
        # velocity that the model cannot explain after a tenth of a second, against the velocity itself
        drift, size = drifts[j], float(np.sqrt(np.mean(v[:, j] ** 2)))
        if size > 0 and drift > 0.1 * size:
            said.append(f"{side}: {100 * drift / size:.0f} % of its velocity is unexplained after 0.1 s")
    return said


def _lasting(result: CalibrationResult) -> list[str]:
    """How large torques are that come and go by no law, and how long they last."""
    robot = result.robot
    torques = lasting_torques(robot)
    if not torques:
        return []
    memory = robot.noise.correlation_time
    units = {name: robot.unit_at(name.rsplit(".", 1)[0], "N m") for name in torques}
    listed = ", ".join(f"{name} {size:.2g} {units[name]}" for name, size in torques.items())
    said = f"random torques last: {listed} (rms), with a memory of {1e3 * memory:g} ms; sigmas include them"
    if memory == MEMORIES[-1]:
        said += "; no longer memory was tried: a drift, a tone or a missing effect looks like this"
    return [said]


def _coloured(result: CalibrationResult) -> list[str]:
    names = [name for name, factor in result.sigma_inflation.items() if factor > COLOURED]
    if len(names) < SEVERAL * len(result.sigma_inflation):
        return []
    largest = max(result.sigma_inflation.values())
    return [
        f"residuals are coloured: standard deviations of {len(names)} values were widened, up to {largest:.1f} times; "
        "an effect may be missing"
    ]
