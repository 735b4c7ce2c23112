# SPDX-License-Identifier: BSD-3-Clause
"""Leaves out where a joint presses against the end of its way: a stop takes up torques that no drive's law knows."""

from __future__ import annotations

from dataclasses import replace

from jointscope.graphs.starts.end_stops import EndStop, end_stops
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording

LISTED = 3  # contacts that are named by their times


def with_end_stops_left_out(recording: Recording, robot: Robot) -> Recording:
    """The recording without the contacts, and with a notice of each stop.

    Raises:
        RecordingError: hardly anything would be left.
    """
    stops = end_stops(robot, recording)
    if not stops:
        return recording
    said = [_sentence(stop, robot) for stop in stops]
    try:
        without = recording.leaving_out([stretch for stop in stops for stretch in stop.stretches])
    except RecordingError as err:
        raise RecordingError(f"{'; '.join(said)}. {err}") from err
    notices = [
        Notice(robot.motor_encoder.name, "end_stop", len(stop.stretches), f"{text}; left out there")
        for stop, text in zip(stops, said, strict=True)
    ]
    return replace(without, notices=[*without.notices, *notices])


def _sentence(stop: EndStop, robot: Robot) -> str:
    length, torque = (robot.unit_at(stop.joint, unit) for unit in ("rad", "N m"))
    times = ", ".join(f"{t0:.2f} to {t1:.2f}" for t0, t1 in stop.stretches[:LISTED])
    more = len(stop.stretches) - LISTED
    total = sum(t1 - t0 for t0, t1 in stop.stretches)
    return (
        f"{stop.joint} presses with up to {stop.torque:.2g} {torque} against something at {stop.at:.4g} {length}, the "
        f"end of its motion, as against an end stop ({times} s{f' and {more} times more' if more > 0 else ''}; "
        f"{total:.2g} s in all)"
    )
