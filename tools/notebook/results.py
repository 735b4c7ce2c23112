# SPDX-License-Identifier: BSD-3-Clause
"""The results of the verbs with what `Shown` adds; each is the result of the computation, too."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, Self

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.graphs.comparison.comparison_result import ComparisonResult
from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.graphs.fixed_lag.window.state_names import state_names
from jointscope.robots.errors import JointscopeError
from jointscope.tools.acceptance.evaluation import FAIL, OPEN, PASS, AcceptedBy
from jointscope.tools.notebook.parameters import Parameters
from jointscope.tools.notebook.shown import Row, Shown
from jointscope.tools.presentation.model_answer import diagnosis_answer, discovery_answer
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.acceptance import acceptance
from jointscope.tools.simulator.simulation import Simulation
from jointscope.tools.terminal.acceptance_text import acceptance_text
from jointscope.tools.verb_parts import result_files
from jointscope.tools.verb_parts.result_files import ResultFiles
from jointscope.tools.verdicts.judgement import Judgement, judge
from jointscope.tools.verdicts.replay_judgement import judge_replay
from jointscope.tools.writing.whole_file import write_json

TOLD = 12  # candidates in a figure
FEW_DECADES = 100.0  # of a logarithmic axis that has room for ticks between them


class Found(Shown):
    """Made from a result of the computation."""

    @classmethod
    def of(cls, found: Any, **more: Any) -> Self:
        """The same result, which shows itself, with what it has beside."""
        return cls(**{field.name: getattr(found, field.name) for field in fields(found)}, **more)


@dataclass(frozen=True, kw_only=True, repr=False)
class _Limited(Found):
    """A result that may be held against limits.

    Attributes:
        acceptance: each limit with its outcome, by the label of the model; empty if none were given.
    """

    acceptance: AcceptedBy = field(default_factory=dict)

    @property
    def accepted(self) -> str:
        """The worst of all lines: "pass", "fail", or "not evaluated", as where no limits were given."""
        outcomes = {line.outcome for lines in self.acceptance.values() for line in lines}
        return FAIL if FAIL in outcomes else OPEN if OPEN in outcomes or not outcomes else PASS

    def _repr_html_(self) -> str:
        """What a notebook shows, the limits below."""
        return super()._repr_html_() + "".join(section.body for section in acceptance(self.acceptance))

    def __repr__(self) -> str:
        """What `print` shows, the limits below."""
        return f"{super().__repr__()}\n{acceptance_text(self.acceptance)}".rstrip()


@dataclass(frozen=True, repr=False)
class Calibrated(_Limited, CalibrationResult):
    """A calibration; `result["joint1.stiffness"]` is one of its parameters or derived results."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", Parameters(self.parameters))  # the dataclass is frozen
        object.__setattr__(self, "derived", Parameters(self.derived))

    def __getitem__(self, name: str) -> ParameterEstimate:
        """A parameter or a derived result by its name.

        Raises:
            RobotError: there is none of that name.
        """
        found: ParameterEstimate = Parameters((*self.parameters, *self.derived))[name]
        return found

    @cached_property
    def judgement(self) -> Judgement:
        """The verdict, and every check that was made with its outcome and reason."""
        return judge(self)

    def answer(self) -> str:
        """Whether the result is good, and below it a line for each reason to doubt it."""
        return self.judgement.answer

    def rows(self) -> list[Row]:
        """A record for each parameter."""
        return [
            {"parameter": p.name, "value": p.value, "sigma": p.sigma, "unit": p.unit, "start": p.start, "note": p.note}
            for p in (*self.parameters, *self.derived)
        ]

    def draw(self, axes: Any) -> None:
        """Residuals of the first recording in their expected sigmas: a good model leaves noise between -3 and 3."""
        for series in self.bags[0].residuals.values():
            whitened = (series.measured - series.predicted) / series.sigma
            for channel, values in zip(series.channels, whitened.T, strict=True):
                axes.plot(series.times, values, linewidth=0.5, label=channel)
        axes.axhspan(-3.0, 3.0, color="0.5", alpha=0.15)
        axes.set(xlabel="time [s]", ylabel="residual [sigma]")
        axes.legend(fontsize="x-small", ncols=3)

    def write(self, files: ResultFiles, more: Mapping[str, Any] | None = None) -> None:
        """Robot file, report, viewer recording, JSON; `more` is for the JSON, too."""
        result_files.write_calibration(self, files, self.acceptance, more)


@dataclass(frozen=True, repr=False)
class Compared(_Limited, ComparisonResult):
    """Models against a recording."""

    def answer(self) -> str:
        """The error of each model."""
        errors = (
            f"{m.label}: {significant(m.judged_error)} sigma (floor {significant(m.judged_floor)})" for m in self.models
        )
        return f"Error {self.models[0].judged_by}, {', '.join(errors)}"

    def rows(self) -> list[Row]:
        """A record for each model and channel: rmse by horizon."""
        return [
            {"model": m.label, "channel": name, "unit": c.unit, "sigma": c.noise_sigma, "fit_percent": c.fit_percent}
            | {f"rmse_{horizon}": value for horizon, value in c.horizons.items()}
            for m in self.models
            for name, c in m.channels.items()
        ]

    def draw(self, axes: Any) -> None:
        """Error 0.1 s ahead of each channel in sigmas of its sensor, model beside model."""
        names = list(self.models[0].channels)
        width = 0.8 / len(self.models)
        for k, m in enumerate(self.models):
            errors = [m.channels[name].horizons["0.1"] / m.channels[name].noise_sigma for name in names]
            axes.bar(np.arange(len(names)) + k * width, errors, width, label=m.label)
        axes.set_xticks(np.arange(len(names)), names, rotation=45, ha="right")
        shown = [patch.get_height() for patch in axes.patches]
        low, high = min(0.5, 0.8 * min(shown)), max(3.0, 1.3 * max(shown))  # differences of noise look small
        steps = (1, 2, 5) if high < FEW_DECADES * low else (1,)
        ticks = [m * 10.0**k for k in range(-3, 9) for m in steps if low <= m * 10.0**k <= high]
        axes.set(yscale="log", ylim=(low, high), ylabel="error 0.1 s ahead [sigma]")
        axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.axhline(1.0, color="0.3", linestyle=":", linewidth=1.0)
        axes.legend(fontsize="x-small", ncols=len(self.models), loc="upper right")

    def write(self, files: ResultFiles) -> None:
        """Report, viewer recording, JSON."""
        result_files.write_comparison(self, files, self.acceptance)


@dataclass(frozen=True, repr=False)
class Diagnosed(_Limited, Diagnosis):
    """Effects that a model may lack."""

    def answer(self) -> str:
        """What is missing."""
        return diagnosis_answer(self).headline

    def rows(self) -> list[Row]:
        """A record for each candidate, best first."""
        return [
            {
                "effect": c.label,
                "verdict": c.verdict,
                "score": c.score,
                "p_value": c.p_value,
                "share": c.share,
                "heldout_error": c.heldout_error,
                "look_alikes": ", ".join(c.look_alikes),
            }
            for c in self.candidates
        ]

    def draw(self, axes: Any) -> None:
        """Scores of the best candidates."""
        best = self.candidates[:TOLD][::-1]
        axes.barh([f"{c.label}: {c.verdict}" for c in best], [c.score for c in best])
        axes.set(xscale="log", xlabel="score")

    def write(self, files: ResultFiles) -> None:
        """Report, viewer recording, JSON."""
        result_files.write_diagnosis(self, files, self.acceptance)


@dataclass(frozen=True, repr=False)
class Discovered(Found, Discovery):
    """The way to a model that lacks nothing, step by step; `robot` is the last one."""

    def answer(self) -> str:
        """What was added."""
        return discovery_answer(self).headline

    def rows(self) -> list[Row]:
        """A record for each step."""
        return [
            {"step": s.label, "train_error": s.train_error, "heldout_error": s.heldout_error, "floor": s.floor}
            for s in self.steps
        ]

    def draw(self, axes: Any) -> None:
        """The waterfall."""
        y = np.arange(len(self.steps))
        axes.barh(y - 0.2, [step.train_error for step in self.steps], 0.4, label="training")
        axes.barh(y + 0.2, [step.heldout_error for step in self.steps], 0.4, label="held out")
        axes.plot([step.floor for step in self.steps], y, "k|", markersize=24, label="floor")
        axes.set_yticks(y, [step.label for step in self.steps])
        axes.invert_yaxis()
        axes.set(xscale="log", xlabel="error [sigma]")
        axes.legend()

    def write(self, files: ResultFiles) -> None:
        """Robot file of the last step, report, viewer recording, JSON."""
        result_files.write_discovery(self, files, self.steps[0].robot.path.name)


@dataclass(frozen=True, repr=False)
class Replayed(Found, ReplayResult):
    """The estimator over a recording."""

    @cached_property
    def judgement(self) -> Judgement:
        """The verdict, and every check that was made with its outcome and reason."""
        return judge_replay(self)

    def answer(self) -> str:
        """Whether the estimator can be trusted, and below it a line for each reason to doubt it."""
        return self.judgement.answer

    def rows(self) -> list[Row]:
        """A record for each kept tick: states and their sigmas."""
        names = state_names(self.robot.layout)
        columns = ("time", *names, *(f"{name}.sigma" for name in names))
        table = np.column_stack([self.states.times, self.states.mean, self.states.sigma])
        return [dict(zip(columns, map(float, row), strict=True)) for row in table]

    def draw(self, axes: Any) -> None:
        """Innovations in their expected sigmas."""
        for series in self.innovations.values():
            for channel, values in zip(series.channels, (series.residual / series.sigma).T, strict=True):
                axes.plot(series.times, values, linewidth=0.5, label=channel)
        axes.axhspan(-3.0, 3.0, color="0.5", alpha=0.15)
        axes.set(xlabel="time [s]", ylabel="innovation [sigma]")
        axes.legend(fontsize="x-small", ncols=3)

    def write(self, files: ResultFiles) -> None:
        """Report, viewer recording, JSON."""
        result_files.write_replay(self, files)


@dataclass(frozen=True, repr=False)
class Simulated(Found, Simulation):
    """A simulated recording and its truth."""

    def answer(self) -> str:
        """What was simulated."""
        effects = ", ".join(f"{each['effect']}@{each['owner']}" for each in self.truth["effects"]) or "none"
        return (
            f"{self.truth['seconds']:g} s of {self.truth['robot']}, motion {self.truth['motion']}, "
            f"seed {self.truth['seed']}, {self.truth['friction']} friction, effects: {effects}"
        )

    def rows(self) -> list[Row]:
        """A record for each stream."""
        return [
            {"stream": stream.name, "samples": len(stream), "channels": ", ".join(stream.channels)}
            for stream in self.recording.streams.values()
        ]

    def draw(self, axes: Any) -> None:
        """True positions of the links."""
        joints = self.recording.command.channels
        positions = self.states[:, : len(joints)]
        for name, values in zip(joints, positions.T, strict=True):
            axes.plot(self.state_times, values, linewidth=0.8, label=name.removesuffix(".command"))
        axes.set(xlabel="time [s]", ylabel="position of the link [rad], [m]")
        axes.legend(fontsize="x-small", ncols=3)

    def write(self, files: ResultFiles) -> None:
        """The truth as JSON; a bag is written by `simulate`.

        Raises:
            JointscopeError: another file is asked for.
        """
        if files.robot or files.report or files.rrd or files.figures or not files.json:
            raise JointscopeError("a simulation is saved as save(json=...); its bag: simulate(robot, 'recording.mcap')")
        write_json(files.json, self.truth)
