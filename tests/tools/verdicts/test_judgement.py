# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on a calibration: a sigma that is too large is no fault, what the model lacks is one."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from fake_results import fake_calibration

from jointscope.graphs.calibration.calibration_result import ParameterEstimate
from jointscope.graphs.calibration.findings import findings
from jointscope.graphs.scoring.drive_timing import DriveTiming
from jointscope.robots.files.effects_at_once import add_effects
from jointscope.tools.verdicts.judgement import Judgement, judge
from jointscope.tools.verdicts.priors.held_values import values_from_data

NOISE, MEMORY = "Residuals as large as the sensor noise", "Residuals without memory"
HELD = "Values from data, not from priors"
CHANNEL = "joint1.motor_position"


@pytest.fixture(scope="module")
def good():
    return fake_calibration()


def with_chi2(result, chi2):
    fit = dataclasses.replace(result.channels[CHANNEL], chi2=chi2)
    return dataclasses.replace(result, channels={**result.channels, CHANNEL: fit})


def coloured(result):
    """The same with residuals of one encoder that come back every 50 ms."""
    bag = result.bags[0]
    series = bag.residuals["motor_encoder"]
    predicted = series.predicted.copy()
    wave = 3.0 * series.sigma[:, 0] * np.sin(2.0 * np.pi * series.times / 0.05)
    predicted[:, 0] = series.measured[:, 0] - wave
    residuals = {**bag.residuals, "motor_encoder": dataclasses.replace(series, predicted=predicted)}
    return dataclasses.replace(result, bags=(dataclasses.replace(bag, residuals=residuals),))


def level(judgement: Judgement, name: str) -> str:
    return next(check.level for check in judgement.checks if check.name == name)


@pytest.mark.parametrize(
    ("chi2", "expected"), [(0.01, "info"), (0.5, "good"), (1.2, "good"), (1.6, "warn"), (4.0, "bad")]
)
def test_only_residuals_that_are_too_large_speak_against_a_calibration(good, chi2, expected):
    assert level(judge(with_chi2(good, chi2)), NOISE) == expected


@pytest.mark.parametrize(("chi2", "expected"), [(1.0, []), (4.0, ["joint1 is late."])])
def test_a_tracker_that_seemed_late_is_a_reason_only_where_the_model_does_not_explain_it(good, chi2, expected):
    result = dataclasses.replace(with_chi2(good, chi2), odd_trackers={"joint1": "joint1 is late"})
    checks = [c for c in judge(result).checks if c.name == "Trackers that stand still and stamp as encoders do"]
    assert [check.text for check in checks] == expected and all(check.level == "bad" for check in checks)


def test_a_memory_in_the_residuals_is_bad_unless_they_are_far_below_the_noise(good):
    assert level(judge(good), MEMORY) == "good"
    assert level(judge(coloured(good)), MEMORY) == "bad"
    assert level(judge(with_chi2(coloured(good), 0.1)), MEMORY) == "warn"


def with_parameter(result, name, **changes):
    parameters = tuple(dataclasses.replace(p, **changes) if p.name == name else p for p in result.parameters)
    return dataclasses.replace(result, parameters=parameters)


def test_a_guess_of_which_the_recordings_tell_nothing_is_no_result(good):
    value = next(p.value for p in good.parameters if p.name == "joint2.stiffness")
    guess = with_parameter(good, "joint2.stiffness", sigma=0.9 * value, prior_sigma=value)
    judgement = judge(guess)
    (check,) = (check for check in judgement.checks if check.name == HELD)
    assert check.level == "bad" and "joint2.stiffness" in check.text and "`fixed: true`" in check.text
    assert judgement.level == "bad"
    # a prior that is narrow beside its value is knowledge
    assert (
        level(judge(with_parameter(good, "joint2.stiffness", sigma=0.09 * value, prior_sigma=0.1 * value)), HELD)
        == "warn"
    )


def held_with(result, label, name):
    """The result of a robot with an effect, one parameter of which no recording has moved."""
    robot = add_effects(result.robot, [label]).robot
    full = f"{label.partition('@')[2]}.{label.partition('@')[0]}.{name}"
    p = robot.parameters[full]
    row = (full, p.value, p.prior_sigma, p.unit, p.value, p.prior, p.prior_sigma)
    held = ParameterEstimate(*row, note="held by its prior")
    return dataclasses.replace(result, robot=robot, parameters=(*result.parameters, held))


@pytest.mark.parametrize(
    "label, name, expected",
    [
        ("encoder_eccentricity@joint1", "order", "info"),  # once per turn: the encoder is built so
        ("bearing_flexibility@joint1", "product_xz", "info"),  # declared weak; the sigmas of the others include it
        ("bearing_flexibility@joint1", "damping_x", "bad"),  # a shape that the motion must show
        ("cogging@joint1", "order", "bad"),  # a guess among many
        ("link_mass@joint1", "mass", "warn"),  # weak, but a size: its value is what the user wants
    ],
)
def test_what_an_effect_leaves_to_its_prior_on_purpose_is_no_doubt(good, label, name, expected):
    determined = with_parameter(good, "joint3.coulomb_torque", sigma=0.01)
    found, text = values_from_data(held_with(determined, label, name))
    assert found == expected
    assert name in text  # said in any case


def test_every_check_is_there_for_machines_with_its_reason(good):
    judgement = judge(with_chi2(good, 4.0))
    content = judgement.to_json()
    assert content["verdict"] == {"level": "bad", "text": judgement.headline}
    assert len(content["checks"]) == len(judgement.checks) == 13
    (noise,) = (check for check in content["checks"] if check["name"] == NOISE)
    assert noise["verdict"] == "bad" and noise["why"].startswith(f"{CHANNEL} has χ² per sample 4")


def following(result, left):
    """Residuals of which states that follow the noise have left a share: neighbours are unlike."""
    bag = result.bags[0]
    series = bag.residuals["motor_encoder"]
    noise = np.random.default_rng(3).standard_normal(len(series.times) + 1)
    predicted, sigma = series.predicted.copy(), series.sigma.copy()
    predicted[:, 0] = series.measured[:, 0] - 1e-5 * (noise[1:] - noise[:-1])
    sigma[:, 0] = np.sqrt(left) * result.robot.motor_encoder.sigmas[0]
    residuals = {
        **bag.residuals,
        "motor_encoder": dataclasses.replace(series, predicted=predicted, sigma=sigma, chi2=np.ones(3)),
    }
    return dataclasses.replace(result, bags=(dataclasses.replace(bag, residuals=residuals),))


def test_neighbours_that_are_unlike_because_states_follow_the_noise_are_no_memory(good):
    assert level(judge(following(good, 0.6)), MEMORY) == "good"  # an autocorrelation of -0.5 is within -0.4 / 0.6
    assert level(judge(following(good, 0.99)), MEMORY) == "warn"
    large = following(good, 0.6)
    series = dataclasses.replace(large.bags[0].residuals["motor_encoder"], chi2=np.full(3, 1.9))
    bag = dataclasses.replace(large.bags[0], residuals={**large.bags[0].residuals, "motor_encoder": series})
    assert level(judge(dataclasses.replace(large, bags=(bag,))), MEMORY) == "warn"  # larger than states could leave


def test_few_samples_are_asked_for_few_lags(good):
    """White noise of 150 samples: of a hundred autocorrelations one would be large by chance."""
    bag = good.bags[0]
    series = bag.residuals["motor_encoder"]
    white = np.random.default_rng(1).standard_normal((150, series.measured.shape[1])) * series.sigma[:150]
    short = dataclasses.replace(
        series,
        times=series.times[:150],
        measured=series.measured[:150],
        predicted=series.measured[:150] - white,
        sigma=series.sigma[:150],
    )
    result = dataclasses.replace(good, bags=(dataclasses.replace(bag, residuals={"motor_encoder": short}),))
    assert level(judge(result), MEMORY) == "good"


def test_a_short_last_step_is_a_remark(good):
    said = findings(dataclasses.replace(good, unsettled=0.021))
    assert any("the iterations ended with a last step of 0.02 sigma" in text for text in said)
    assert not any("last step" in text for text in findings(good))


def test_a_sigma_that_was_found_anew_is_said_from_a_fifth_on(good):
    def found(factor):
        encoder = good.robot.motor_encoder
        other = dataclasses.replace(encoder, sigmas=encoder.sigmas * factor)
        robot = good.robot.with_sensors({encoder.name: other})
        return " ".join(findings(dataclasses.replace(good, robot=robot)))

    assert "`estimate_sigma: false` in sensors.motor_encoder keeps yours" in found(0.4)
    assert "joint1.motor_position 2.77e-05 rad (was 6.93e-05)" in found(0.4)
    assert "estimate_sigma" not in found(0.9)


def test_the_page_that_explains_the_verdict_names_every_check(good):
    page = (Path(__file__).parents[3] / "docs" / "is_it_good.md").read_text(encoding="utf-8")
    assert [check.name for check in judge(good).checks if f"| {check.name} |" not in page] == []


def test_where_one_step_is_too_long_no_number_is_said(good):
    value = next(p.value for p in good.parameters if p.name == "joint1.coulomb_torque")
    for change, said in ((0.1, "would be about"), (300.0, "joint1.coulomb_torque would change by more than half")):
        late = DriveTiming(9e-3, 1e-4, {"joint1.coulomb_torque": change * value})
        (check,) = (c for c in judge(dataclasses.replace(good, timing=late)).checks if c.name.endswith("same time"))
        assert check.level == "bad" and said in check.text
        assert (f"{301 * value:.3g}" in check.text) is False


def uneven(result, share=0.5):
    """The same with a stretch in which the dynamics leave a part of the velocity open."""
    bag = result.bags[0]
    process = bag.process.copy()
    process[: len(process) // 8] *= 1.0 + share
    return dataclasses.replace(result, bags=(dataclasses.replace(bag, process=process),))


def test_two_doubtful_signs_together_are_no_reservation(good):
    name = "No two signs that something is missing"
    dynamics = "Dynamics hold throughout"
    # as much as makes the dynamics doubtful, not bad
    lone = next(
        found
        for share in (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
        if level(judge(found := uneven(good, share)), dynamics) == "warn"
    )
    assert judge(lone).level == "warn"
    assert judge(with_chi2(good, 1.6)).level == "warn"
    both = judge(with_chi2(lone, 1.6))
    assert both.level == "bad"
    assert level(both, name) == "bad"
    assert all(check.name != name for check in judge(lone).checks)


@pytest.mark.parametrize(
    ("shifts", "expected"),
    [(None, "info"), ({}, "good"), ({"joint1.inertia": 0.005}, "good"), ({"a.inertia": -0.02}, "bad")],
)
def test_steps_in_which_friction_stops_a_light_joint_are_told(good, shifts, expected):
    judged = judge(dataclasses.replace(good, inertia_shifts=shifts))
    assert level(judged, "Steps short enough") == expected


def test_a_value_that_may_as_well_be_zero_has_no_share_but_is_not_determined(good):
    lost = with_parameter(good, "joint2.stiffness", value=1e-160, sigma=0.1)
    said = next(text for text in findings(lost) if "parameters from" in text)
    assert said.endswith("worst joint2.stiffness, not determined") and "e+" not in said
    near_zero = dataclasses.replace(lost.robot.parameters["joint2.stiffness"], positive=False)
    lever = dataclasses.replace(
        lost, robot=dataclasses.replace(lost.robot, parameters={**lost.robot.parameters, near_zero.name: near_zero})
    )
    assert not any("not determined" in text for text in findings(lever))  # 0.1 is far less than its prior's sigma
    known = next(text for text in findings(good) if "parameters from" in text)
    assert re.search(r"typically \+-[\d.]+ %, worst \S+ with \+-[\d.]+ %$", known)
