# SPDX-License-Identifier: BSD-3-Clause
"""Simulated bags for the benchmark, kept in the temporary folder of the system between runs."""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from patience import say

import jointscope.tools.simulator as simulator
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.write_bag import write_bag

SEED = 1


def simulated_bag(seconds: float) -> tuple[Path, dict[str, Any]]:
    """A bag of Doggy's calibration motion with smooth friction, and the true values by full name."""
    folder = Path(tempfile.gettempdir()) / f"jointscope-bench-{_fingerprint()}"
    bag, truth = folder / f"calibration_{seconds:g}s.mcap", folder / f"calibration_{seconds:g}s.truth.json"
    if not (bag.is_file() and truth.is_file()):
        say(f"simulating {seconds:g} s")
        robot = load_robot("doggy")
        simulation = simulator.simulate(robot, "calibration", seconds, seed=SEED, friction="smooth")
        write_bag(bag, simulation.recording, robot)
        truth.write_text(json.dumps(simulation.truth), encoding="utf-8")
    return bag, json.loads(truth.read_text(encoding="utf-8"))["parameters"]


def largest_error(values: Mapping[str, float], truth: Mapping[str, Any]) -> tuple[str, float]:
    """Name and relative error [%] of the parameter that is farthest off."""
    errors = {name: 100.0 * abs(value / truth[name] - 1.0) for name, value in values.items()}
    name = max(errors, key=lambda n: errors[n])
    return name, errors[name]


def _fingerprint() -> str:
    """Changes when the simulator or the robot does, so that no stale bag is used."""
    code = sorted(Path(simulator.__file__).parent.rglob("*.py"))
    robot = load_robot("doggy")
    content = b"".join(path.read_bytes() for path in (*code, robot.path, robot.tree.urdf))
    return hashlib.sha256(content + str(SEED).encode()).hexdigest()[:12]
