# SPDX-License-Identifier: BSD-3-Clause
"""Faults of a BioRob, each at two sizes on an arm of its own: is it named first, and how large does it come out?

An interrupted run goes on where it stopped, as long as the code is the same.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from biorob_arms import drawn_arm
from kept_rows import code_of, keep, known_rows
from patience import say
from tables import Section, Table

import jointscope as js
from jointscope.graphs.discovery.diagnose import diagnose
from jointscope.graphs.refits.validation import heldout_error
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

SECONDS = (10.0, 5.0)  # to learn from, and of other moves to judge by
KEPT = Path(tempfile.gettempdir()) / "jointscope-biorob-faults.jsonl"
FAULTS: tuple[tuple[str, tuple[dict[str, float], dict[str, float]]], ...] = (  # a small and a large size of each
    ("axis_misalignment@joint3", ({"x": 0.03, "y": 0.0}, {"x": 0.089, "y": 0.0})),
    ("friction_by_direction@joint4", ({"torque": 0.01, "coefficient": 0.0}, {"torque": 0.03, "coefficient": 0.0})),
    ("backlash@joint1", ({"half_gap": 0.1}, {"half_gap": 0.4})),
    ("kinematic_coupling@joint4", ({"from_joint3": 0.03}, {"from_joint3": 0.1})),
    (
        "encoder_eccentricity@joint3.link",
        (
            {"cos": 0.004, "sin": 0.003, "cos2": -0.002, "sin2": 0.002},
            {"cos": 0.02, "sin": 0.03, "cos2": -0.015, "sin2": 0.01},
        ),
    ),
    ("encoder_delay@link_encoder", ({"delay": 0.001}, {"delay": 0.004})),
    ("encoder_offset@joint2.link", ({"offset": 0.01}, {"offset": 0.05})),
    ("spring_cubic@joint3", ({"stiffness": 0.3}, {"stiffness": 1.5})),
    ("spring_slack@joint2", ({"forward": 0.05, "backward": 0.0}, {"forward": 0.3, "backward": 0.0})),
    ("encoder_harmonics@joint1.link", ({"cos": 0.003, "sin": 0.0}, {"cos": 0.01, "sin": 0.01})),
    ("encoder_hysteresis@joint3.link", ({"half_play": 0.0015}, {"half_play": 0.004})),
)


def faults() -> Section:
    """What a diagnosis names first, and what a calibration with it finds, from a model that does not know the fault."""
    code, rows = code_of(__file__), []
    known = known_rows(KEPT, code)
    for number, (label, sizes) in enumerate(FAULTS):
        for size, values in zip(("small", "large"), sizes, strict=True):
            name = f"{label}, {size}"
            say(f"faults: {name}")
            if name not in known:
                known[name] = {"name": name, **_tried(label, values, 2 * number + (size == "large"))}
                keep(KEPT, code, known[name])
            rows.append(known[name])
    first = [row["first"] == row["name"].split(",")[0] for row in rows]
    within = [abs(z) < 3.0 for row in rows for z in row["off"].values()]
    summary = [
        ("named first [%]", "95", f"{100 * np.mean(first):.0f} of {len(first)}"),
        ("sizes within 3 sigma [%]", "", f"{100 * np.mean(within):.0f} of {len(within)}"),
        ("one diagnosis, median [CPU s]", "", f"{np.median([row['cpu'] for row in rows]):.0f}"),
    ]
    cells = [
        (row["name"], row["first"] or "nothing", _told(row["off"]), " -> ".join(f"{e:.2f}" for e in row["heldout"]))
        for row in rows
    ]
    each = ("fault", "named first", "its sizes, off [sigma]", "held out before -> with it [sigma]")
    text = f"{SECONDS[0]:g} s of motion, {SECONDS[1]:g} s of other moves held out, by MuJoCo with dry friction."
    tables = [Table("Faults", ("what", "wanted", "measured"), summary), Table("Each", each, cells)]
    return Section("BioRob, faults", text, tables=tables)


def _tried(label: str, values: Mapping[str, float], seed: int) -> dict[str, Any]:
    """One fault of one arm."""
    parameters, effects = drawn_arm(seed)
    effects = [*effects, f"{label}:{','.join(f'{name}={value}' for name, value in values.items())}"]
    train, test = (
        js.simulate("biorob", motion=motion, seconds=t, seed=seed, parameters=parameters, effects=effects).recording
        for motion, t in zip(("calibration", "moves"), SECONDS, strict=True)
    )
    start = time.process_time()
    found = diagnose(load_robot("biorob"), [train], test, missing_torque=False)
    cpu = time.process_time() - start
    best = next((c.label for c in found.candidates if c.verdict == "missing"), "")
    grown = js.calibrate(add_effect(load_robot("biorob"), label), train).robot
    own = {name: grown.parameters["{1}.{0}.{2}".format(*label.split("@"), name)] for name in values}
    off = {name: (p.value - values[name]) / (p.sigma or np.nan) for name, p in own.items()}
    return {"first": best, "off": off, "heldout": [found.error, heldout_error(grown, test)], "cpu": cpu}


def _told(off: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {z:+.1f}" for name, z in off.items())
