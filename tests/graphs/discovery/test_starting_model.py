# SPDX-License-Identifier: BSD-3-Clause
"""By what a search judges its models: decided once, and calibrated for."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from jointscope.graphs.discovery import starting_model as module
from jointscope.graphs.discovery.discovery_result import DiscoveryStep, with_lasting_floors
from jointscope.graphs.discovery.starting_model import is_quiet, starting_model
from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Notice


@pytest.fixture
def asked(monkeypatch):
    """What was calibrated for which measure, where a judge is as quiet as wanted."""

    def ask(quiet, one_encoder=True, loop=False, sticks=False):
        calibrated = []

        def of(robot, recordings, by_torques, solver):
            calibrated.append(by_torques)
            return SimpleNamespace(by_torques=by_torques)

        monkeypatch.setattr(module, "BaseModel", SimpleNamespace(of=of))
        monkeypatch.setattr(module, "seen_by_one_encoder", lambda robot: one_encoder)
        monkeypatch.setattr(module, "judged_by_loop", lambda robot, recordings: loop)
        monkeypatch.setattr(module, "torque_judge", lambda base: None if quiet is None else "judge")
        monkeypatch.setattr(module, "is_quiet", lambda judge: quiet)
        monkeypatch.setattr(module, "screen_all", lambda recording, robot: [])
        monkeypatch.setattr(module, "_as_sharp_as_told", lambda base, solver: base)
        monkeypatch.setattr(module, "_as_sharp_as", lambda other, base: base)
        monkeypatch.setattr(module, "_predicts_better", lambda model, than: sticks)
        return starting_model("robot", ["recording"]).by_torques, calibrated

    return ask


def test_quiet_encoders_are_asked_of_torques(asked):
    assert asked(True) == (True, [True])


def test_a_gyro_of_the_other_hand_ends_the_search_before_it_begins(asked, monkeypatch):
    assert asked(True)[0]
    notices = [Notice("imu2", "axes", 0, "turned"), Notice("imu2", "mirrored", 0, "imu2: no rotation does that")]
    monkeypatch.setattr(module, "screen_all", lambda recording, robot: notices)
    with pytest.raises(RecordingError, match=r"a.mcap: imu2: no rotation does that; no effect .* leave imu2 out of it"):
        starting_model("robot", [SimpleNamespace(path="a.mcap")])


def test_an_accelerometer_that_feels_another_gravity_ends_it_too(asked, monkeypatch):
    notices = [Notice("acc", "gravity", 0, "acc feels gravity the other way")]
    monkeypatch.setattr(module, "screen_all", lambda recording, robot: notices)
    with pytest.raises(RecordingError, match=r"a.mcap: acc feels gravity the other way; .* leave acc out of it"):
        starting_model("robot", [SimpleNamespace(path="a.mcap")])


@pytest.mark.parametrize("quiet", (False, None))
def test_where_encoders_do_not_tell_torques_standstills_come_back(asked, quiet):
    assert asked(quiet) == (False, [True, False])


def test_where_standstill_contradicts_the_law_torques_are_asked_all_the_same(asked):
    assert asked(False, sticks=True) == (True, [True, False])
    assert asked(None, sticks=True) == (False, [True, False])


def test_other_robots_are_calibrated_once(asked):
    assert asked(True, one_encoder=False) == (False, [False])
    assert asked(True, loop=True) == (False, [False])


@pytest.mark.parametrize(("sigma", "quiet"), [(1e-6, True), (1e-3, False)])
def test_quiet_is_what_is_small_beside_the_missing_torque(sigma, quiet):
    # an inertia of 2 kg m2, 8 Hz, ticks of 4 ms: 2 (2 pi 8)^2 1e-3 sqrt(2 4e-3 8) = 1.28 N m of noise for 1e-3 rad
    robot = SimpleNamespace(free_inertias=lambda: 2.0, motor_encoder=SimpleNamespace(sigmas=sigma))
    segment = SimpleNamespace(problem=SimpleNamespace(robot=robot))
    equations = SimpleNamespace(band=8.0, period=4e-3, steps=[SimpleNamespace(segment=segment)])
    assert is_quiet(SimpleNamespace(equations=equations, missing=4.2)) == quiet


def test_noise_alone_leaves_no_more_than_with_the_best_model():
    base = DiscoveryStep(None, None, None, 483.0, 312.0, 348.0, None, None)
    nan = float("nan")
    steps = [base, *(replace(base, floor=floor) for floor in (1.0, nan, 2.35))]
    assert [step.floor for step in with_lasting_floors(steps)] == [1.0, 1.0, 2.35, 2.35]
