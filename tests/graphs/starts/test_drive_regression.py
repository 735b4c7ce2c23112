# SPDX-License-Identifier: BSD-3-Clause
"""The regression finds drives of arms that another program moved, at any rates, and says how sure it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, divided, moved, written

from jointscope.graphs.starts.drive_regression import Driven, drive_equations
from jointscope.graphs.starts.motion_cells import motion_cells
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Stream

ARM = Arm()
NOISE = 1e-5  # [rad]


def tree_of(arm, folder):
    return RigidTree(written(arm, folder), arm.joints, np.array(arm.gravity))


def equations(arm, folder, streams, noise=NOISE, **options):
    sigmas = np.full(len(arm.joints), noise)
    return drive_equations(tree_of(arm, folder), [Driven(*streams)], sigmas, **options)


@pytest.fixture(scope="module")
def streams():
    return moved(ARM)


@pytest.mark.parametrize(
    ("encoder_rate", "command_rate", "within"),
    [(100.0, 100.0, 0.01), (50.0, 50.0, 0.02), (250.0, 100.0, 0.01), (100.0, 1000.0, 0.01), (1000.0, 50.0, 0.01)],
)
def test_every_value_of_a_clean_arm_is_within_a_percent(tmp_path, encoder_rate, command_rate, within):
    """A command that is held must be filtered like the motion: half a sample of delay would cost more than that."""
    streams = moved(ARM, encoder_rate=encoder_rate, command_rate=command_rate)
    for j, equation in enumerate(equations(ARM, tmp_path, streams)):
        found = equation.solve({"gain": 1.0})
        for name, value in found.items():
            assert value.value == pytest.approx(ARM.truth(j)[name], rel=within), (ARM.joints[j], name)


def test_the_torque_of_a_unit_is_found_with_everything_else(tmp_path, streams):
    encoder, command = streams
    constants = (16.0, -6.0, 0.7)
    for j, equation in enumerate(equations(ARM, tmp_path, (encoder, divided(command, constants)))):
        found = equation.solve()
        assert found["gain"].value == pytest.approx(constants[j], rel=5e-3)
        for name in ("inertia", "dry", "viscous"):
            assert found[name].value == pytest.approx(ARM.truth(j)[name], rel=0.015), name
        assert np.sign(equation.direction().value) == np.sign(constants[j])


@pytest.mark.parametrize("count", [1, 2, 9])
def test_a_handful_of_positions_is_refused_in_words(streams, count):
    encoder, command = streams
    few = replace(encoder, times=encoder.times[:count], values=encoder.values[:count])
    with pytest.raises(RecordingError, match=f"there are {count} positions; expected at least 10"):
        motion_cells(few, command, np.full(3, NOISE))


@pytest.mark.parametrize("seed", [2, 3])
def test_sigmas_hold_for_coarse_encoders(tmp_path, seed):
    step = 2.0 * np.pi / 4096
    streams = moved(ARM, counts=4096, noise=0.0, seed=seed)
    for j, equation in enumerate(equations(ARM, tmp_path, streams, step / np.sqrt(12.0))):
        for name, value in equation.solve({"gain": 1.0}).items():
            error = value.value - ARM.truth(j)[name]
            assert abs(error) < max(4.0 * value.sigma, 0.02 * ARM.truth(j)[name]), (ARM.joints[j], name)
            assert value.sigma < 0.2 * ARM.truth(j)[name]


def test_a_slide_is_a_joint_like_others(tmp_path):
    arm = Arm("zX", inertia=(0.4, 3.0), dry=(1.0, 6.0), viscous=(0.5, 8.0))
    for j, equation in enumerate(equations(arm, tmp_path, moved(arm))):
        for name, value in equation.solve({"gain": 1.0}).items():
            assert abs(value.value - arm.truth(j)[name]) < max(3.5 * value.sigma, 0.01 * arm.truth(j)[name]), name
            assert value.sigma < 0.03 * arm.truth(j)[name], name


def test_a_single_vertical_axis_gives_ratios_only(tmp_path):
    arm = Arm("z", inertia=(0.3,), dry=(1.0,), viscous=(0.5,))
    (equation,) = equations(arm, tmp_path, moved(arm))
    assert equation.solve() == {}
    for known in ({"gain": 1.0}, {"inertia": 0.3}):
        found = {name: value.value for name, value in equation.solve(known).items()}
        assert found | known == pytest.approx({n: v for n, v in arm.truth(0).items()}, rel=0.01)


def test_standstill_is_left_out_as_friction_is_below_its_limit_there(tmp_path):
    streams = moved(ARM, seconds=10.0, pause=0.6)
    assert 0.2 < motion_cells(*streams, np.full(3, NOISE)).known.mean() < 0.9
    for j, equation in enumerate(equations(ARM, tmp_path, streams)):
        found = equation.solve({"gain": 1.0})
        assert found["dry"].value == pytest.approx(ARM.truth(j)["dry"], rel=0.02)
        assert found["inertia"].value == pytest.approx(ARM.truth(j)["inertia"], rel=0.02)


@pytest.mark.parametrize("rate", [50.0, 100.0, 250.0])
def test_reversals_at_which_a_joint_sticks_for_a_moment_are_left_out(tmp_path, rate):
    """For some hundredths of a second friction is below its limit there, just where accelerations are largest."""
    arm = Arm("yxy", dry=(4.0, 1.5, 0.5))
    sticking = {"sticks": True, "noise": 5e-5, "seconds": 20.0, "seed": 3}
    streams = moved(arm, encoder_rate=rate, command_rate=rate, **sticking)
    for j, equation in enumerate(equations(arm, tmp_path, streams, noise=5e-5)):
        for name, value in equation.solve({"gain": 1.0}).items():
            assert value.value == pytest.approx(arm.truth(j)[name], rel=0.0125), (arm.joints[j], name)


def test_what_is_left_out_or_missing_changes_nothing(tmp_path, streams):
    encoder, command = streams
    pushed = encoder.values + np.where((encoder.times > 4.0) & (encoder.times < 4.5), 0.3, 0.0)[:, None]
    there = (encoder.times < 6.0) | (encoder.times > 6.7)
    damaged = Stream("encoder", encoder.times[there], pushed[there], encoder.channels, "rad")
    sigmas = np.full(3, NOISE)
    found = drive_equations(tree_of(ARM, tmp_path), [Driven(damaged, command, [(3.97, 4.53)])], sigmas)
    for j, equation in enumerate(found):
        for name, value in equation.solve({"gain": 1.0}).items():
            assert value.value == pytest.approx(ARM.truth(j)[name], rel=0.015), name


def test_two_recordings_tell_more_than_one(tmp_path, streams):
    tree, sigmas = tree_of(ARM, tmp_path), np.full(3, NOISE)
    one = drive_equations(tree, [Driven(*streams)], sigmas)
    both = drive_equations(tree, [Driven(*streams), Driven(*moved(ARM, seed=5))], sigmas)
    windows = [[e.sums.counts.sum() * e.sums.width for e in some] for some in (one, both)]
    assert np.all(np.array(windows[1]) > 1.5 * np.array(windows[0]))
    for j, equation in enumerate(both):
        assert equation.solve({"gain": 1.0})["inertia"].value == pytest.approx(ARM.truth(j)["inertia"], rel=0.01)


def test_a_recording_that_is_too_short_tells_nothing(tmp_path, streams):
    encoder, command = (stream.between(2.0, 2.2) for stream in streams)
    assert all(equation.solve() == {} for equation in equations(ARM, tmp_path, (encoder, command)))


def test_clocks_that_share_no_time_are_said(streams):
    encoder, command = streams
    late = replace(command, times=command.times + 1000.0)
    with pytest.raises(RecordingError, match=r"commands \(1000\.000 to 1007\.\d+ s\) do not overlap; check that their"):
        motion_cells(encoder, late, np.full(3, NOISE))
    fast = [replace(stream, times=1e-6 * stream.times) for stream in (encoder, command)]
    with pytest.raises(RecordingError, match=r"share only \S+e-06 s, with .* at least 0.1 s: record longer, or check"):
        motion_cells(*fast, np.full(3, NOISE))


@pytest.mark.parametrize("held", [True, False])
def test_means_of_a_command_are_those_of_what_acted(held):
    rng = np.random.default_rng(0)
    times = np.cumsum(rng.uniform(0.005, 0.015, 100))
    command = Stream("command", times, rng.normal(size=(100, 1)), ("a",), "N m")
    samples = np.linspace(0.1, 0.9, 100)
    cells = motion_cells(Stream("e", samples, np.sin(samples)[:, None], ("a",), "rad"), command, np.zeros(1), held)
    fine = (
        np.arange(cells.times[0] - cells.h / 2.0, cells.times[-1] + cells.h / 2.0 - 1e-9, cells.h / 400.0)
        + cells.h / 800
    )
    acting = command.values[np.searchsorted(times, fine, side="right") - 1, 0]
    acted = acting if held else np.interp(fine, times, command.values[:, 0])
    np.testing.assert_allclose(cells.u[:, 0], acted.reshape(-1, 400).mean(axis=1), atol=0.01)


def test_a_sign_that_is_smooth_in_the_model_is_smooth_here(tmp_path, streams):
    sharp, soft = (equations(ARM, tmp_path, streams, sharpness=s)[0].solve({"gain": 1.0}) for s in (1e4, 2.0))
    # friction that saturates late is larger where it does, if the torque is the same
    assert soft["dry"].value > 1.15 * sharp["dry"].value
