# SPDX-License-Identifier: BSD-3-Clause
"""Types `init`, `info` and `calibrate` as a new user does, each in a fresh process, and what a refusal says to do."""

from __future__ import annotations

import os
import re
import resource
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

MEMORY = 6 * 2**30  # [B] a process may have; a mistake shall not stop the machine
FOLLOWED = 3  # refusals in a row whose advice is taken
QUICK_LIMIT = 300.0  # [s] of computing, for a verb that only looks
PATIENCE = 10.0  # times a limit, on the wall: a busy machine takes no row out of the table
ROBOT, RESULT, JSON = "robot.yaml", "calibrated.yaml", "calibration.json"
COMMAND = re.compile(r"jointscope (?:init|info|calibrate|add|remove)(?: [^`\n;)]*[^`\n;),.: ])?")
PLACEHOLDER = re.compile(r"(?:^|\s)(?:\.\.\.|…|[A-Z]{3,}[A-Z.a-z]*)(?=\s|$)")
REFUSAL = re.compile(r"^No, ", re.MULTILINE)
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Typed:
    """One command and what came of it.

    Attributes:
        line: what was typed, without the program's name.
        code: exit code; negative for a signal, 124 where the time was over.
        out, err: what it said.
        cpu: [s]; of all its threads.
        megabytes: the most that it held.
    """

    line: str
    code: int
    out: str
    err: str
    cpu: float
    megabytes: float

    @property
    def crashed(self) -> bool:
        """Whether it ended in a way that no user should see."""
        return self.code not in (0, 1, 2) or "Traceback" in self.err or "a bug in jointscope" in self.err

    @property
    def refused(self) -> bool:
        """Whether it says that it cannot do what was typed, or not well."""
        return self.code != 0 or bool(REFUSAL.search(self.out))

    def next_command(self) -> str | None:
        """The command that its refusal says to type, if it can be typed as it stands."""
        for found in COMMAND.findall(self.err if self.code else self.out):
            command = str(found).removeprefix("jointscope ")
            if not PLACEHOLDER.search(command) and " " in command:
                return command
        return None


@dataclass
class Session:
    """All that was typed for one robot; the last command is the one that counts.

    Attributes:
        typed: commands in their order.
        advice: commands of `typed` that a refusal had named.
        robot_file: which one the calibration was made from.
        result: where the calibration's numbers are.
    """

    typed: list[Typed] = field(default_factory=list)
    advice: list[str] = field(default_factory=list)
    robot_file: str = ROBOT
    result: str = JSON

    @property
    def last(self) -> Typed:
        """The command after which nothing more was typed."""
        return self.typed[-1]


def first_contact(folder: Path, urdf: str, bag: str, limit: float) -> Session:
    """Robot file, look at the recording, calibration; where one refuses and says what to type, that is typed.

    Args:
        folder: where the commands run; it is left as they leave it.
        urdf: path of the URDF as it is typed.
        bag: path of the recording as it is typed.
        limit: of the calibration [s of computing].
    """
    session = Session()
    waiting = [f"init {urdf} {bag} -o {ROBOT}"]
    while waiting:
        line = waiting.pop(0)
        verb = line.split()[0]
        done = run_verb(shlex.split(line), folder, limit if verb == "calibrate" else QUICK_LIMIT)
        session.typed.append(done)
        advice = done.next_command() if done.refused and not done.crashed else None
        if advice and advice not in session.advice and len(session.advice) < FOLLOWED:
            session.advice.append(advice)
            waiting = [advice]
        elif done.code == 0:
            waiting = waiting or _what_follows(session, line, bag)
        else:
            break
    return session


def run_verb(arguments: Sequence[str], folder: Path, limit: float) -> Typed:
    """Runs one verb, as `jointscope` on the command line does."""
    command = [sys.executable, "-m", "jointscope.tools.command_line", *arguments]
    out, err = folder / ".out", folder / ".err"
    environment = {**os.environ, **dict.fromkeys(THREADS, "1")}
    with out.open("wb") as stdout, err.open("wb") as stderr:
        process = subprocess.Popen(
            command, cwd=folder, env=environment, stdout=stdout, stderr=stderr, preexec_fn=partial(_limited, limit)
        )
        ended, status, used = _wait(process.pid, PATIENCE * limit)
        process.returncode = os.waitstatus_to_exitcode(status)
    texts = [path.read_text(encoding="utf-8", errors="replace") for path in (out, err)]
    out.unlink()
    err.unlink()
    code = process.returncode if ended and process.returncode != -signal.SIGXCPU else 124
    return Typed(shlex.join(arguments), code, *texts, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)


def _what_follows(session: Session, line: str, bag: str) -> list[str]:
    """The next commands of a user whose last one went well."""
    words = shlex.split(line)
    verb, made = words[0], words[words.index("-o") + 1] if "-o" in words else None
    if verb in ("init", "add", "remove"):
        session.robot_file = made or session.robot_file
        look = [f"info {bag} --robot {session.robot_file}"] if verb == "init" else []
        return [*look, f"calibrate {session.robot_file} {bag} -o {RESULT} --json {JSON}"]
    if verb == "info":
        return [f"calibrate {session.robot_file} {bag} -o {RESULT} --json {JSON}"]
    if "--json" not in words:  # an advised calibration: the numbers are needed, too
        return [f"{line} --json {JSON}"]
    return []


def _wait(pid: int, limit: float) -> tuple[bool, int, resource.struct_rusage]:
    """Waits for a process, and ends it when its time is over."""
    deadline = time.monotonic() + limit
    while time.monotonic() < deadline:
        found, status, used = os.wait4(pid, os.WNOHANG)
        if found:
            return True, status, used
        time.sleep(0.05)
    os.kill(pid, signal.SIGKILL)
    _, status, used = os.wait4(pid, 0)
    return False, status, used


def _limited(seconds: float) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    whole = max(1, round(seconds))
    resource.setrlimit(resource.RLIMIT_CPU, (whole, whole + 5))
