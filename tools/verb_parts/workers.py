# SPDX-License-Identifier: BSD-3-Clause
"""The options --workers and --scheduler: who computes beside this process."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from jointscope.robots.errors import ClusterError

if TYPE_CHECKING:
    from jointscope.graphs.discovery.side_by_side import SideBySide
    from jointscope.robots.model.robot import Robot
    from jointscope.robots.recordings.recording import Recording


def add_workers_option(parser: argparse.ArgumentParser) -> None:
    """Adds both options, to verbs that fit several models."""
    _add(parser, 0, "processes that fit candidates, and keep recordings, in parallel; default: one per core")


def add_spreading_option(parser: argparse.ArgumentParser) -> None:
    """Adds both options, to verbs that fit one model."""
    _add(parser, 1, "processes over which several bags are spread; default 1")


@contextmanager
def workers_of(args: argparse.Namespace) -> Iterator[SideBySide]:
    """The processes or the cluster that were asked for; no process has begun.

    Raises:
        ClusterError: the cluster cannot be used.
    """
    from jointscope.graphs.discovery.side_by_side import SideBySide
    from jointscope.graphs.solving.solver_context import available_cores

    if args.scheduler is None:
        with SideBySide(args.workers or available_cores(), args.effects) as workers:
            yield workers
        return
    from jointscope.graphs.workers.dask_cluster import DaskCluster

    with DaskCluster(args.scheduler, args.effects) as cluster:
        with SideBySide(cluster.slots, args.effects, cluster) as workers:
            yield workers


def check_workers(workers: SideBySide, robot: Robot, recordings: Sequence[Recording]) -> None:
    """Says before the work begins where memory will not do, here or at workers.

    Raises:
        ClusterError: a worker has too little memory, or nothing can be spread.
        RecordingError: this machine has too little.
    """
    from jointscope.graphs.spread.memory_needed import must_fit, must_fit_here

    if robot.free_links:
        if workers.cluster is not None:
            raise ClusterError(f"{robot.name}: its links are free, which is solved at once; leave out --scheduler")
        return
    must_fit_here(robot, recordings)
    must_fit(workers.solver.crew, robot, recordings)


def check_one_choice(args: argparse.Namespace) -> None:
    """Processes or a cluster, not both.

    Raises:
        ClusterError: both.
    """
    if args.scheduler is not None and args.workers > 1:
        raise ClusterError("--workers starts processes here, and --scheduler names a cluster; give one of them")


def _add(parser: argparse.ArgumentParser, default: int, what: str) -> None:
    parser.add_argument(
        "--workers", metavar="N", type=_count, default=default, help=f"{what}; the result does not depend on it"
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="a Dask cluster to use instead, tcp://HOST:8786 (extra `cluster`)",
    )


def _count(text: str) -> int:
    """A number of processes."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a number of processes from 1 on, got {text!r}")
    return int(text)
