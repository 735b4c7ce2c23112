# SPDX-License-Identifier: BSD-3-Clause
"""The fixed-lag estimator on the BioRob: how long an update takes at 500 Hz, and whether its covariance is right."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
from estimator_case import Case
from estimator_consistency import BOUNDS, within
from estimator_latency import BEGIN
from estimator_run import LAG, driven, run
from message_feed import in_order
from patience import say
from tables import Section, Table

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.fixed_lag import FixedLagEstimator
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.simulator import Disturbance, Simulation, simulate

TAIL = 0.5  # [ms]
SEEDS = range(1, 11)
TRAINING, SECONDS = 12.0, 6.0  # [s]
TORQUE = {"link": 0.05, "motor": 0.05}  # [N m] on links and pulleys, new each millisecond


def lag(data: Path) -> Section:
    """Times on the recording of the folder, normalised errors where the true states are known."""
    section = Section(
        "BioRob, fixed lag",
        f"16 states, {LAG:g} s lag. Times: `clean/test`, commands and encoders at 500 Hz; an update is all messages of "
        f"a cycle fed and `state()` asked with its covariance. Normalised squares: {len(SEEDS)} simulated recordings "
        f"of {SECONDS:g} s of moves with encoders at 500 Hz, dry friction and random torques of {TORQUE['link']:g} N m "
        f"on links and pulleys, with a robot that was calibrated on {TRAINING:g} s of another one, noise included.",
    )
    say("lag: calibrating with clean/train")
    train, test = (next(iter(sorted((data / "clean").glob(f"{name}*")))) for name in ("train", "test"))
    robot = calibrate(load_robot("biorob"), [read_recording(train, load_robot("biorob"))]).robot
    _time(section, robot, read_recording(test, robot))
    _judge(section)
    return section


def _time(section: Section, robot: Robot, recording: Recording) -> None:
    say("lag: timing")
    estimator, messages = FixedLagEstimator(robot, LAG), in_order(recording)
    gc.collect()
    gc.freeze()
    taken = np.array([(c.wall, c.cpu) for c in driven(estimator, messages, idle=False)])[BEGIN:]
    gc.unfreeze()
    (p50, p99), (cpu50, cpu99) = (1e3 * np.quantile(times, [0.5, 0.99]) for times in taken.T)
    section.promise("update, median", "", f"{p50:.3f} ms")
    section.promise("update, 99 of 100", f"below {TAIL:g} ms", f"{p99:.3f} ms", p99 < TAIL)
    section.promise("&nbsp;&nbsp;CPU time: median; 99 of 100", "", f"{cpu50:.3f} ms; {cpu99:.3f} ms")
    section.numbers["latency_ms"] = {"p50": p50, "p99": p99, "updates": len(taken)}


def _judge(section: Section) -> None:
    say("lag: calibrating a simulated arm")
    first = _simulated("calibration", TRAINING, 0)
    robot = calibrate(load_robot("biorob"), [first.recording]).robot
    rows, found = [], []
    for seed in SEEDS:
        say(f"lag: seed {seed} of {len(SEEDS)}")
        case = Case(robot, _simulated("moves", SECONDS, seed))
        one = run(case, robot, in_order(case.recording))
        found.append((float(one.now.nees.mean()), float(one.lagged.nees.mean()), one.nis_mean))
        rows.append((str(seed), *(f"{value:.3f}" for value in found[-1])))
    nees, lagged, nis = np.mean(found, axis=0)
    for name, value in (("NEES now", nees), (f"NEES {LAG:g} s later", lagged), ("NIS", nis)):
        wanted = f"{BOUNDS[0]:g} to {BOUNDS[1]:g}"
        section.promise(f"mean {name}", wanted, f"{value:.3f}", within(float(value)))
    section.tables.append(Table("Recordings", ("seed", "NEES now", f"NEES {LAG:g} s later", "NIS"), rows))
    section.numbers["normalised"] = found


def _simulated(motion: str, seconds: float, seed: int) -> Simulation:
    disturbance = Disturbance(**TORQUE)
    return simulate(
        load_robot("biorob"), motion, seconds, seed, disturbance=disturbance, encoder_rate=500.0, hardware_seed=0
    )
