# SPDX-License-Identifier: BSD-3-Clause
"""Shows a replay in the viewer while it runs: the same views as the file, filled piece by piece."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from jointscope.graphs.fixed_lag.estimated_state import EstimatedState
from jointscope.graphs.fixed_lag.messages.event import Event
from jointscope.graphs.fixed_lag.replay.tick_log import TickLog
from jointscope.graphs.fixed_lag.tick import Tick
from jointscope.robots.errors import JointscopeError
from jointscope.robots.model.robot import Robot
from jointscope.robots.outside_modules import need_module
from jointscope.tools.rerun_log.entities.correlation_over_time import send_correlations
from jointscope.tools.rerun_log.entities.estimate_lines import send_estimate_lines
from jointscope.tools.rerun_log.entities.event_lines import send_events, send_latency
from jointscope.tools.rerun_log.entities.innovation_lines import send_innovations, send_nis
from jointscope.tools.rerun_log.entities.rrd_file import APPLICATION
from jointscope.tools.rerun_log.log_replay import replay_blueprint, send_pose

if TYPE_CHECKING:
    import rerun as rr

PIECE = 0.25  # [s] of recording that is sent at once
PORT = 9876  # the viewer's own choice
START = 30.0  # [s] that the viewer may take to start
FLUSH = 20.0  # [s] that the last data may take on their way
SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
PAUSE = 0.1  # [s] of wall time between two pieces at least


@contextmanager
def live_replay(
    robot: Robot, adapted: tuple[str, ...] = (), stream: rr.RecordingStream | None = None
) -> Iterator[LiveReplay]:
    """Opens the viewer, or takes the one that is open.

    Args:
        robot: the model.
        adapted: names of the adapted parameters.
        stream: where to send to instead of a viewer.

    Raises:
        JointscopeError: the viewer does not start.
    """
    stream = stream or _stream_to_viewer(robot, adapted)
    live = LiveReplay(robot, stream)
    try:
        yield live
        live.send()
    finally:
        # a viewer that was closed in the meantime must not hold up the end
        with suppress(Exception):
            stream.flush(timeout_sec=FLUSH)
        stream.disconnect()


def _stream_to_viewer(robot: Robot, adapted: tuple[str, ...]) -> rr.RecordingStream:
    need_module("rerun")
    import rerun as rr

    if not _listens():
        _start_viewer()
    stream = rr.RecordingStream(APPLICATION)
    stream.set_log_time_enabled(False)
    stream.connect_grpc(f"rerun+http://127.0.0.1:{PORT}/proxy", default_blueprint=replay_blueprint(robot, adapted))
    return stream


def _start_viewer() -> None:
    """Starts the viewer and waits until it listens: the package itself would wait for ever for one that died."""
    has_screen = not sys.platform.startswith("linux") or any(os.environ.get(name) for name in SCREENS)
    if has_screen:
        command = [sys.executable, "-m", "rerun", "--port", str(PORT), "--hide-welcome-screen"]
        viewer = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        end = time.monotonic() + START
        while viewer.poll() is None and time.monotonic() < end:
            if _listens():
                return
            time.sleep(0.1)
    reason = "it did not start" if has_screen else "there is no screen"
    raise JointscopeError(f"cannot show the replay live: {reason}; write a file with --rrd and `jointscope view` it")


def _listens() -> bool:
    """Whether a viewer takes connections."""
    with socket.socket() as probe:
        probe.settimeout(0.2)
        return probe.connect_ex(("127.0.0.1", PORT)) == 0


class LiveReplay:
    """Collects ticks and sends them in pieces."""

    def __init__(self, robot: Robot, stream: rr.RecordingStream):
        self._robot, self._stream = robot, stream
        self._log = TickLog(robot)
        self._events: list[Event] = []
        self._begin = float("-inf")
        self._sent = 0.0
        self._magnified: float | None = None

    def add(self, tick: Tick, lagged: EstimatedState | None, events: tuple[Event, ...]) -> None:
        """Adds a tick; sends what was collected when there is enough of it."""
        if not self._log.ticks:
            self._begin = tick.state.time
        self._log.add(tick, lagged, tick.seconds)
        self._events += events
        if tick.state.time - self._begin >= PIECE and time.monotonic() - self._sent >= PAUSE:
            self.send()

    def send(self) -> None:
        """Sends what was collected and begins anew."""
        if not self._log.ticks:
            return
        stream, robot, log = self._stream, self._robot, self._log
        states, covariances, latency = log.states(), log.covariances(), log.latency()
        send_innovations(stream, log.innovations())
        send_nis(stream, log.innovations())
        send_estimate_lines(stream, robot, states, log.lagged())
        send_correlations(stream, robot, covariances, 1)
        self._magnified = send_pose(stream, robot, states, covariances, self._magnified)
        send_events(stream, self._events)
        send_latency(stream, latency.times, latency.seconds, histogram=False)
        self._log, self._events, self._sent = TickLog(robot), [], time.monotonic()
