# SPDX-License-Identifier: BSD-3-Clause
"""Reads and calibrates one bag in a process of its own and prints what it took as JSON.

Usage: python benchmarks/timed_calibration.py BAG
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_recording import read_recording


def main(path: str) -> None:
    """Calibrates `doggy` with the bag."""
    robot = load_robot("doggy")
    started = time.perf_counter()
    recording = read_recording(path, robot)
    read = time.perf_counter() - started
    cpu = time.process_time()
    result = calibrate(robot, [recording])
    took = {
        "read_seconds": read,
        "wall_seconds": result.wall_seconds,
        "cpu_seconds": time.process_time() - cpu,
        "peak_bytes": peak_bytes(),
        "state_unknowns": result.bags[0].states.size,
        "iterations": len(result.iterations),
        "parameters": {name: result.robot.parameters[name].value for name in robot.parameters},
        "sigmas": {name: result.robot.parameters[name].sigma for name in robot.parameters},
    }
    print(json.dumps(took))


def peak_bytes() -> int:
    """Largest resident memory of this process.

    Linux hands the peak of the parent on to `ru_maxrss` of a child, so the process's own mark comes first.
    """
    status = Path("/proc/self/status")
    if status.is_file():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


if __name__ == "__main__":
    main(sys.argv[1])
