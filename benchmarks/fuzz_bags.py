# SPDX-License-Identifier: BSD-3-Clause
"""Puts damaged bags through the verbs: never a traceback, a hang, a half-written file, more than two gigabytes.

Usage: python benchmarks/fuzz_bags.py [--trials N] [--deep N] [--first K] [--jobs N] [--findings FILE]

The trials run one after the other in one process; a second one watches it, and starts it again behind a trial that does
not end. A trial's number makes its bag again: --first 17 --trials 1.
"""

from __future__ import annotations

import argparse
import json
import os
import selectors
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path
from typing import Any

from measured_page import write_section
from patience import say

TRIALS, DEEP = 2000, 200
HANG = 60.0  # [s] of computing
PATIENCE = 10.0  # times that, on the wall
LARGEST = 2048.0  # [MB]
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def main() -> int:
    arguments = _parse()
    if arguments.worker:
        _work(range(*arguments.worker), arguments.deep_worker)
        return 0
    os.environ.update(dict.fromkeys(THREADS, "1"))
    stretches = [
        (part, deep)
        for deep, count in ((False, arguments.trials), (True, arguments.deep))
        for part in _parts(arguments.first, count, arguments.jobs)
    ]
    began = time.perf_counter()
    with ThreadPoolExecutor(arguments.jobs) as pool:
        reports = [report for part in pool.map(lambda job: list(_watched(*job)), stretches) for report in part]
    findings = [finding for report in reports for finding in report["findings"]]
    minutes = (time.perf_counter() - began) / 60
    most = max((report["megabytes"] for report in reports), default=0.0)
    told = _text(findings, len(reports), minutes, most)
    print(told)
    if arguments.trials >= TRIALS and arguments.deep >= DEEP:
        write_section(f"## Damaged bags through the verbs\n\n{told}")
    if arguments.findings:
        arguments.findings.write_text(json.dumps(findings, indent=1), encoding="utf-8")
    return int(bool(findings))


def _watched(trials: range, deep: bool) -> Iterator[dict[str, Any]]:
    """Reports of all trials of a stretch, whatever becomes of the process in which they run."""
    left = trials
    while left:
        command = [sys.executable, __file__, "--worker", str(left.start), str(left.stop)]
        process = subprocess.Popen([*command, *["--deep-worker"] * deep], stdout=subprocess.PIPE)
        assert process.stdout is not None
        started = False
        for line in _lines(process.stdout.fileno(), process.pid):
            report = json.loads(line)
            if report["trial"] >= 0:
                left = range(report["trial"] + 1, trials.stop)
                yield report
            started = True
        try:
            ended = process.wait(5.0)  # after the end of its pipe it has little left to do
        except subprocess.TimeoutExpired:
            ended = None
            process.kill()
            process.wait()
        if left and started:
            what = f"no end within {HANG:g} s" if ended is None else f"the process died with exit code {ended}"
            finding = {"trial": left.start, "deep": deep, "damage": "", "verb": "", "what": what, "where": ""}
            yield {"trial": left.start, "megabytes": 0.0, "findings": [finding]}
            left = range(left.start + 1, trials.stop)
        elif left:
            raise SystemExit("the process of the trials does not start")


def _lines(source: int, pid: int) -> Iterator[bytes]:
    """Lines of a pipe, until it ends or its writer computes for too long, or does nothing for much longer."""
    rest, last, last_cpu = b"", time.monotonic(), 0.0
    with selectors.DefaultSelector() as selector:
        selector.register(source, selectors.EVENT_READ)
        while _cpu(pid) - last_cpu < HANG and time.monotonic() - last < PATIENCE * HANG:
            if not selector.select(1.0):
                continue
            block = os.read(source, 65536)
            if not block:
                return
            *whole, rest = (rest + block).split(b"\n")
            last, last_cpu = time.monotonic(), _cpu(pid)
            yield from whole


def _cpu(pid: int) -> float:
    """What a process has computed [s]: on a busy machine a clock on the wall says little."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _work(trials: range, deep: bool) -> None:
    """Runs trials and prints a report of each; what the verbs print goes elsewhere."""
    from fuzz_trial import limit_memory, megabytes, run_trial

    pipe = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    limit_memory()
    print(json.dumps({"trial": -1, "megabytes": megabytes(), "findings": []}), file=pipe, flush=True)
    for trial in trials:
        findings = [finding.to_json() for finding in run_trial(trial, deep)]
        print(json.dumps({"trial": trial, "megabytes": megabytes(), "findings": findings}), file=pipe, flush=True)
        if findings or trial % 100 == 99:
            say(f"{'deep ' * deep}trial {trial}" + "".join(f": {f['verb']}: {f['what'][-150:]}" for f in findings))


def _parts(first: int, count: int, jobs: int) -> list[range]:
    """Nearly equal stretches of the trials."""
    bounds = [first + count * k // jobs for k in range(jobs + 1)]
    return [range(a, b) for a, b in pairwise(bounds) if b > a]


def _text(findings: list[dict[str, Any]], trials: int, minutes: float, megabytes: float) -> str:
    """What was found, one kind after the other: findings at one place are one kind."""
    said = "yes" if megabytes <= LARGEST else "**no**"
    lines = [f"{trials} trials in {minutes:.1f} min, at most {megabytes:.0f} MB (below {LARGEST:g}: {said})", ""]
    kinds: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for finding in findings:
        kinds.setdefault((finding["verb"], finding["where"] or finding["what"][-120:]), []).append(finding)
    lines += [f"{len(findings)} findings of {len(kinds)} kinds", ""]
    for (verb, where), members in sorted(kinds.items(), key=lambda kind: -len(kind[1])):
        first = members[0]
        deep = "deep " if first["deep"] else ""
        lines.append(
            f"- {verb}: {where}: {len(members)} times, first in {deep}trial {first['trial']} ({first['damage']}):"
        )
        lines.append(f"  {first['what']}")
    return "\n".join(lines)


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python benchmarks/fuzz_bags.py",
        description="Puts damaged bags through the verbs; below an hour. One trial again: --first 17 --trials 1",
    )
    parser.add_argument("--trials", type=int, default=TRIALS, metavar="N", help="through info and init")
    parser.add_argument("--deep", type=int, default=DEEP, metavar="N", help="through calibrate and replay")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="number of the first trial")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes; 2 by default")
    parser.add_argument("--findings", type=Path, metavar="FILE", help="write all findings for machines, too")
    parser.add_argument("--worker", type=int, nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("--deep-worker", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
