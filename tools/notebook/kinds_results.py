# SPDX-License-Identifier: BSD-3-Clause
"""Results of searches over several kinds of recordings with what `Shown` adds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from jointscope.graphs.across_kinds.diagnose_kinds import KindsDiagnosis
from jointscope.graphs.across_kinds.discover_kinds import KindsDiscovery
from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.graphs.joint_kinds.discover_arm import scored
from jointscope.tools.notebook.results import TOLD, Found
from jointscope.tools.notebook.shown import Row
from jointscope.tools.terminal.searches.kinds_discovery_text import left_said, step_label
from jointscope.tools.terminal.searches.kinds_text import kinds_headline, kinds_sentences
from jointscope.tools.verb_parts.result_files import ResultFiles
from jointscope.tools.verb_parts.searches import kinds_search


@dataclass(frozen=True, kw_only=True, repr=False)
class KindsDiagnosed(Found, KindsDiagnosis):
    """Effects that a model may lack, by recordings of several kinds.

    Attributes:
        given: recordings that were learnt from.
        held: those that never chose.
    """

    given: KindsRecordings
    held: KindsRecordings

    def answer(self) -> str:
        """What is missing and who shows it, and a line for each contradiction between kinds."""
        return "\n".join([kinds_headline(self), *kinds_sentences(self)])

    def rows(self) -> list[Row]:
        """A record for each effect, best first."""
        return [
            {
                "effect": c.label,
                "verdict": c.verdict,
                "shown_by": ", ".join(c.shown_by),
                "against": ", ".join(c.against),
                "evidence": c.evidence,
                "look_alikes": ", ".join(c.look_alikes),
            }
            for c in self.candidates
        ]

    def draw(self, axes: Any) -> None:
        """Evidence of the effects that some kind shows."""
        best = [c for c in self.candidates if c.shown_by][:TOLD][::-1]
        names = [f"{c.label}: {c.verdict}, {' and '.join(c.shown_by)}" for c in best]
        axes.barh(names, [c.evidence for c in best])
        axes.set(xlabel="2 ln of how much likelier left-out recordings become")

    def write(self, files: ResultFiles) -> None:
        """Report and viewer recording where there is motion, and JSON."""
        arm = None
        if self.arm_base is not None:
            arm = scored(self.arm_base, self.arm, self.held.poses, self.held.shaken)
        kinds_search.write_kinds_diagnosis(self, arm, files)


@dataclass(frozen=True, repr=False)
class KindsDiscovered(Found, KindsDiscovery):
    """The way to one model by recordings of several kinds, step by step; `robot` is the last one."""

    def answer(self) -> str:
        """What came in, and what all kinds say of the last model."""
        added = ", ".join(step_label(step) for step in self.steps[1:]) or "nothing was added"
        return f"{self.robot.name}: {added}\n{left_said(self)}"

    def rows(self) -> list[Row]:
        """A record for each step: errors by kind, of recordings that were learnt from and of those held out."""
        return [
            {"step": step_label(step), **train} | {f"heldout_{kind}": error for kind, error in heldout.items()}
            for step, (train, heldout) in zip(self.steps, self.errors, strict=True)
        ]

    def draw(self, axes: Any) -> None:
        """Error of each kind over that of the last model."""
        for kind in self.given.kinds:
            errors = np.array([train[kind] for train, _ in self.errors])
            if errors[-1] > 0.0:
                axes.plot(range(len(errors)), errors / errors[-1], marker="o", label=kind)
        axes.set_xticks(range(len(self.steps)), [step_label(step) for step in self.steps], rotation=20, ha="right")
        axes.set(yscale="log", ylabel="error over that of the last model")
        axes.legend()

    def write(self, files: ResultFiles) -> None:
        """Robot file of the last step, report, JSON."""
        kinds_search.write_kinds_discovery(self, files)
