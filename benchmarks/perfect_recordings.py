# SPDX-License-Identifier: BSD-3-Clause
"""On recordings in which nothing is wrong, nothing may be named: no push, no mistake, no odd reading.

The recordings are those that the other benchmarks measure on, as the simulator makes them without anything hidden,
calibrated by the model that made them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from arm_row import ACCUSING
from patience import say
from tables import Section, Table

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.comparison.compare import compare_model
from jointscope.graphs.screening.saturated_drives import SATURATION
from jointscope.graphs.screening.screen_all import screen_all
from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.simulator import simulate

# kinds of notices that say that something is wrong with a recording
ODD = ("duplicate", "out_of_order", "gap", "clipping", "dropped", "unit", "axes", SATURATION)
SECONDS = {"calibration": 20.0, "moves": 8.0}
SEEDS = (1, 2, 3)


@dataclass(frozen=True)
class Named:
    """What was named on a recording that is right."""

    recording: str
    by: str
    text: str


def run(quick: bool) -> Section:
    """Simulates, calibrates, compares, and lists what was named."""
    section = Section(
        "Perfect recordings",
        "Simulated Doggys with smooth friction, nothing hidden: what the screening, `calibrate` and `compare` name "
        "although it is not there.",
    )
    named, count = [], 0
    for seed in SEEDS[:1] if quick else SEEDS:
        say(f"perfect recordings: seed {seed}")
        named += list(_named(seed))
        count += len(SECONDS)
    section.promise(f"pushes and mistakes named on {count} perfect recordings", "none", str(len(named)), not named)
    if named:
        rows = [(item.recording, item.by, item.text) for item in named]
        section.tables.append(Table("Named although it is not there", ("recording", "by", "text"), rows))
    section.numbers["named"] = [vars(item) for item in named]
    return section


def accusations(robot: Robot, recording: Recording) -> list[str]:
    """What the screening and the reader say against a recording."""
    notices = [*screen_all(recording, robot), *recording.notices]
    return [notice.text for notice in notices if notice.kind in ODD]


def _named(seed: int) -> Iterator[Named]:
    """Everything that is named about one robot's recordings."""
    robot = load_robot("doggy")
    made = {
        motion: simulate(robot, motion, seconds, seed, friction="smooth").recording
        for motion, seconds in SECONDS.items()
    }
    for motion, recording in made.items():
        for text in accusations(robot, recording):
            yield Named(f"{motion}, seed {seed}", "screening", text)
    try:
        calibration = calibrate(robot, [made["calibration"]])
    except JointscopeError as err:
        yield Named(f"calibration, seed {seed}", "calibrate", str(err))
        return
    for text in calibration.findings:
        if ACCUSING.search(text):
            yield Named(f"calibration, seed {seed}", "calibrate", text)
    for moment in compare_model("calibrated", calibration.robot, made["moves"]).isolated:
        yield Named(f"moves, seed {seed}", "compare", moment.sentence(made["moves"]))
