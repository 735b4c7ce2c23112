# SPDX-License-Identifier: BSD-3-Clause
"""What a state estimate is worth to a controller: state feedback that hits balls, fed by three sources of the state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from tables import Section, Table, Target

from jointscope.graphs.calibration.base_model import with_full_gyros
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.tools.closed_loop.run_closed_loop import LoopOptions, run_closed_loop
from jointscope.tools.simulator.occasion import Conditions
from jointscope.tools.simulator.simulation import simulate

Array = NDArray[np.float64]

SECONDS = 10.0  # [s] of each run
SEEDS = range(5)
HARDWARE = 100  # seed of the mounting errors, which a calibration finds
BEARING = "bearing_flexibility@joint2"
SOURCES = ("true", "estimator", "encoders")
TRAINING = 20.0  # [s] of calibration motion


def run_section(quick: bool) -> Section:
    """Hits with parameters that are a little off; then with a soft bearing that the model lacks, or has."""
    seeds = SEEDS[:1] if quick else SEEDS
    plain = {source: _misses(seeds, source) for source in SOURCES}
    lacking, having = _calibrated()
    soft = Conditions(effects=[BEARING], hardware_seed=HARDWARE)
    without, found = (_misses(seeds, "estimator", soft, model) for model in (lacking, having))
    rows = [
        ("parameters 2 % off (1 sigma)", name, *_told(plain[source]))
        for source, name in zip(
            SOURCES, ("true state", "FixedLagEstimator", "differentiated encoders, 40 Hz"), strict=True
        )
    ]
    rows += [
        ("soft bearing, model calibrated without it", "FixedLagEstimator", *_told(without)),
        ("soft bearing, model calibrated with it", "FixedLagEstimator", *_told(found)),
    ]
    ratio = _rms(plain["encoders"]) / _rms(plain["estimator"])
    targets = [
        Target("misses with differentiated encoders over those with the estimator", "", f"{ratio:.2g} times"),
        Target("misses without the bearing over those with it", "", f"{_rms(without) / _rms(found):.2g} times"),
    ]
    setting = (
        "Distance of the head from the ball at the moment of each hit; state feedback in MuJoCo with dry friction that "
        f"sticks, {len(seeds)} runs of {SECONDS:g} s with a robot, mounting errors and balls of their own. "
        f"The soft bearing is `{BEARING}`; both models were calibrated with {TRAINING:g} s of the robot that has it."
    )
    head = ("model", "states from", "hits", "rms [mm]", "worst [mm]")
    return Section("Closed loop", setting, targets, [Table("Misses", head, rows)])


def _misses(seeds: range, source: str, conditions: Conditions | None = None, model: Robot | None = None) -> Array:
    """How far each hit of all runs is off [m]."""
    found: list[float] = []
    for seed in seeds:
        options = LoopOptions(("state_feedback",), (source,))
        result = run_closed_loop(load_robot("doggy"), model, SECONDS, seed, conditions, options)
        (run,) = result.runs
        found += [hit.position for hit in run.tracking.hits]
    return np.array(found)


def _calibrated() -> tuple[Robot, Robot]:
    """Models of the robot with the soft bearing: one that lacks it, and one that has it."""
    robot = load_robot("doggy")
    recording = simulate(robot, "calibration", TRAINING, effects=[BEARING], hardware_seed=HARDWARE).recording
    lacking = calibrate(with_full_gyros(robot), [recording]).robot
    return lacking, calibrate(add_effect(lacking, BEARING), [recording]).robot


def _told(misses: Array) -> tuple[str, str, str]:
    return str(len(misses)), f"{1e3 * _rms(misses):.2g}", f"{1e3 * misses.max():.2g}"


def _rms(misses: Array) -> float:
    return float(np.sqrt(np.mean(misses**2)))
