# SPDX-License-Identifier: BSD-3-Clause
"""Results that say which recordings they come from, so that reports can name and draw them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.discovery_result import Discovery, DiscoveryStep
from jointscope.robots.recordings.recording import Recording


def diagnosis_of(result: Diagnosis, recordings: Sequence[Recording], heldout: Recording | None) -> Diagnosis:
    """The diagnosis with its recordings."""
    return replace(result, recordings=tuple(recordings), heldout=heldout)


def discovery_of(result: Discovery, recordings: Sequence[Recording], heldout: Recording | None) -> Discovery:
    """The discovery with its recordings, in every diagnosis, too."""

    def named(step: DiscoveryStep) -> DiscoveryStep:
        if step.diagnosis is None:
            return step
        return replace(step, diagnosis=diagnosis_of(step.diagnosis, recordings, heldout))

    steps = tuple(named(step) for step in result.steps)
    return replace(result, steps=steps, recordings=tuple(recordings), heldout=heldout, held_out=heldout is not None)
