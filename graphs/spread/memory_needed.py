# SPDX-License-Identifier: BSD-3-Clause
"""How much memory recordings will take, said before the work begins."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.factors.calibration import Calibration
from jointscope.graphs.spread.spread_solver import spread_evenly
from jointscope.graphs.workers.crew import Crew
from jointscope.graphs.workers.local_processes import available_memory
from jointscope.robots.errors import ClusterError, RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

NUMBER = 8  # [bytes]
GIGABYTE = 1e9  # [bytes]
PROCESS = 0.25e9  # [bytes] of a worker with what it imports
PEAK = 1.3  # times what one solution takes; measured on 65 s of Doggy, more where torques that last are found, too


def must_fit(crew: Crew, robot: Robot, recordings: Sequence[Recording]) -> None:
    """Refuses recordings that the workers of a crew cannot keep.

    Raises:
        ClusterError: one of them has too little memory left.
    """
    if len(recordings) < 2 or crew.slots < 2:
        return
    needed = [kept_bytes(robot, recording) for recording in recordings]
    slots = spread_evenly([ticks_of(robot, recording) for recording in recordings], crew.slots)
    for left, own in crew.memories:
        mine = [i for i, slot in enumerate(slots) if slot in own]
        total = sum(needed[i] for i in mine) + PROCESS * len({slots[i] for i in mine})
        if total > left:
            raise ClusterError(
                f"{crew.name}: {len(mine)} of {len(recordings)} recordings need about {total / GIGABYTE:.1f} GB in one "
                f"place, and {max(left, 0.0) / GIGABYTE:.1f} GB are left there; take more workers, workers with more "
                "memory, or shorter recordings"
            )


def must_fit_here(robot: Robot, recordings: Sequence[Recording]) -> None:
    """Refuses recordings whose uncertainties cannot be computed in the memory of this machine.

    Raises:
        RecordingError: too little memory is left.
    """
    needed, left = sum(solved_bytes(robot, recording) for recording in recordings), available_memory()
    if needed > left:
        seconds = sum(recording.duration for recording in recordings)
        raise RecordingError(
            f"{len(recordings)} recordings with {seconds:.0f} s need at least "
            f"{needed / GIGABYTE:.1f} GB of memory, and {left / GIGABYTE:.1f} GB are left on this machine; give "
            "shorter recordings, or fewer"
        )


def ticks_of(robot: Robot, recording: Recording) -> int:
    """About how many states a recording has: one for each command or sample of the motors' encoder."""
    return max(len(recording.command.times), len(recording.streams[robot.motor_encoder.name].times))


def kept_bytes(robot: Robot, recording: Recording) -> float:
    """Of a worker: normal equations where it is and where it was tried, each with the band that was eliminated."""
    d, p = robot.layout.size, Calibration.of(robot).size
    system = 2 * d * d + d * p + 2 * d
    return float(NUMBER * ticks_of(robot, recording) * 2 * (system + 2 * d * d))


def solved_bytes(robot: Robot, recording: Recording) -> float:
    """Of the process that solves: normal equations, their elimination, and covariances of all states."""
    d, p = robot.layout.size, Calibration.of(robot).size
    return float(PEAK * NUMBER * ticks_of(robot, recording) * (3 * d * p + 6 * d * d))
