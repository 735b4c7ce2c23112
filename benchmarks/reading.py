# SPDX-License-Identifier: BSD-3-Clause
"""How fast a long recording is read from each kind of bag."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from patience import say
from tables import Section

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

SECONDS = 5.0  # [s] for 260,000 messages
FORMATS = ("bag", "db3", "mcap")
REPEATS = 3


def run(quick: bool) -> Section:
    """Writes four topics of 65 s at 1 kHz in every format and reads them again; `quick` takes 6.5 s."""
    duration = 6.5 if quick else 65.0
    robot = load_robot("doggy")
    recording = _made_up(robot, duration)
    count = recording.sample_count
    section = Section(
        "Reading",
        f"{count:,} messages on 4 topics, {duration:g} s at 1 kHz; hash of the file included. The best of {REPEATS} "
        "runs, with the file in the cache of the operating system.",
    )
    with tempfile.TemporaryDirectory(prefix="jointscope-bench-") as folder:
        for fmt in FORMATS:
            say(f"reading: .{fmt}")
            path = Path(folder) / f"long.{fmt}"
            write_bag(path, recording, robot)
            seconds = min(_seconds(path, robot, recording) for _ in range(REPEATS))
            target = SECONDS * count / 260_000
            section.promise(f".{fmt}", f"below {target:g} s", f"{seconds:.2f} s", seconds < target)
            section.numbers[fmt] = {"messages": count, "seconds": seconds, "bytes": path.stat().st_size}
    return section


def _seconds(path: Path, robot: Robot, written: Recording) -> float:
    """Time of one reading; what was read must be what was written."""
    started = time.perf_counter()
    read = read_recording(path, robot)
    seconds = time.perf_counter() - started
    for name, stream in written.streams.items():
        if not np.array_equal(read.streams[name].values, stream.values):
            raise AssertionError(f"{path.name}: {name} is not read as it was written")
    return seconds


def _made_up(robot: Robot, duration: float) -> Recording:
    """Random values on all streams: a reader does not look at what they mean."""
    rng = np.random.default_rng(1)
    times = np.arange(round(duration * 1000)) / 1000.0
    channels = tuple(f"{joint}.command" for joint in robot.joints)
    streams = {"command": Stream("command", times, rng.uniform(-0.9, 0.9, (len(times), robot.n)), channels, "1", times)}
    for name, sensor in robot.sensors.items():
        values = 0.1 * rng.standard_normal((len(times), len(sensor.channels)))
        streams[name] = Stream(name, times, values, sensor.channels, sensor.units[0], times)
    return Recording("made up", "", 1_767_225_600_000_000_000, streams)
