# SPDX-License-Identifier: BSD-3-Clause
"""What the estimator is worth in the loop: one sentence and the errors at the hits."""

from __future__ import annotations

from html import escape

from jointscope.tools.closed_loop.closed_loop_result import CONTROLLERS, SOURCES, ClosedLoopResult, LoopRun
from jointscope.tools.presentation.model_answer import Answer
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.answer_box import answer_box
from jointscope.tools.report.page.page import Section
from jointscope.tools.report.sections.closed_loop.loop_colours import COLOURS

NEAR = 1.5  # times the error with the true state
FIGURES = 3  # of the best controllers that are shown
MODEL_LIMITS = 0.7  # of the error with encoders: if the true state does not help more than this, the model is wrong


def loop_answer(result: ClosedLoopResult) -> Section:
    """The box at the top."""
    if not result.hits_balls:
        runs = sorted(result.runs, key=lambda run: run.tracking.e_rms)[:FIGURES]
        figures = [(_followed(run), f"{run.label}, E_rms") for run in runs]
        return answer_box(
            "answer", "How closely is the plan followed?", loop_judgement(result), figures, _findings(result)
        )
    controller = "state_feedback" if result.run("state_feedback", result.runs[0].source) else result.runs[0].controller
    runs = [run for run in result.runs if run.controller == controller]
    figures = [(_big(run), f"{SOURCES[run.source]}, off at the hit") for run in runs]
    return answer_box("answer", "Does the head hit the ball?", loop_judgement(result), figures, _findings(result))


def loop_judgement(result: ClosedLoopResult) -> Answer:
    """The estimator beside the true state and the encoders, under state feedback where there is any."""
    for controller in ("state_feedback", "p"):
        found = result.run(controller, "estimator")
        if found is not None:
            return _judge(found, result.run(controller, "true"), result.run(controller, "encoders"))
    if not result.hits_balls:
        return _best_follower(result)
    best = min(result.runs, key=lambda run: run.tracking.hit_position)
    headline = f"Best: {best.label}, {_millimetres(best)} off at the hits."
    return Answer("info", headline, "The estimator was not among the sources.")


def _best_follower(result: ClosedLoopResult) -> Answer:
    """The controller with the smallest error over the whole plan, beside the next of the same source."""
    best = min(result.runs, key=lambda run: run.tracking.e_rms)
    others = [run for run in result.runs if run.source == best.source and run is not best]
    headline = f"Best: {best.label}, E_rms {significant(best.tracking.e_rms)} rad over links and motors."
    if not others:
        return Answer("info", headline, "No other controller was run with the same source.")
    following = min(others, key=lambda run: run.tracking.e_rms)
    share = 100.0 * (1.0 - best.tracking.e_rms / following.tracking.e_rms)
    return Answer("info", headline, f"{share:.0f} % less than the next, {following.label}.")


def _judge(found: LoopRun, true: LoopRun | None, encoders: LoopRun | None) -> Answer:
    error = found.tracking.hit_position
    if true is not None and encoders is not None:
        if true.tracking.hit_position > MODEL_LIMITS * encoders.tracking.hit_position:
            return _model_limits(found, true, encoders)
    headline = f"With the estimator in the loop the head is {_millimetres(found)} off at the hits"
    level, parts = "good", []
    if encoders is not None:
        ratio = encoders.tracking.hit_position / error
        better = f"{significant(ratio, 2)} times closer than" if ratio >= 1 else "no closer than"
        headline += f", {better} with differentiated encoders"
        level = "good" if ratio >= 1 else "bad"
        parts.append(f"with differentiated encoders it is {_millimetres(encoders)}")
    if true is not None:
        near = error <= NEAR * true.tracking.hit_position
        level = level if near or level == "bad" else "warn"
        parts.append(f"with the true state, which only a simulator knows, {_millimetres(true)}")
    name = CONTROLLERS[found.controller]
    why = f"{name[0].upper()}{name[1:]}: {'; '.join(parts)}." if parts else "No other source was compared."
    return Answer(level, f"{headline}.", why)


def _model_limits(found: LoopRun, true: LoopRun, encoders: LoopRun) -> Answer:
    """Knowing the state better does not help where the law cannot use it."""
    name = CONTROLLERS[found.controller]
    headline = f"The state is not the limit: even with the true state the head is {_millimetres(true)} off at the hits."
    why = (
        f"{name[0].upper()}{name[1:]}: with the estimator {_millimetres(found)}, with differentiated encoders "
        f"{_millimetres(encoders)}. "
    )
    if found.controller == "p":
        return Answer("info", headline, f"{why}The P-controller uses nothing of the state but the motor angle.")
    return Answer("bad", headline, f"{why}The model is wrong where it matters: diagnose says what it lacks.")


def _findings(result: ClosedLoopResult) -> list[str]:
    truth = result.truth
    effects = ", ".join(f"{e['effect']}@{e['owner']}" for e in truth["effects"])
    told = [
        f"Truth: {truth['robot']}, seed {truth['seed']}, {result.plan.count} in {truth['seconds']:g} s, "
        f"{truth['friction']} friction, hidden effects: {effects or 'none'}",
        f"Controllers and estimator know {result.model_told}",
    ]
    told += [f"{sentence[0].upper()}{sentence[1:]}" for sentence in result.unstable]
    p = result.run("p", "encoders")
    if p is not None and result.run("state_feedback", "encoders") is not None:
        told.append(
            f"The P-controller, {_millimetres(p)} off at the hits, knows no model and lags behind a moving target"
        )
    account = next((run.estimator for run in reversed(result.runs) if run.estimator is not None), None)
    if account is not None:
        update, alarms = account.update_ms, ", ".join(account.alarms)
        told.append(f"One tick of the estimator took {update['p50']:.2f} ms (median), {update['p99']:.2f} ms (99 %)")
        doubt = f"found larger innovations than its model allows in {alarms}" if alarms else "raised no alarm"
        told.append(f"The estimator {doubt}")
    return told


def _millimetres(run: LoopRun) -> str:
    return f"{significant(1e3 * run.tracking.hit_position, 2)} mm"


def _followed(run: LoopRun) -> str:
    number = escape(significant(run.tracking.e_rms))
    return f'<i class="coloured {COLOURS[run.source]}" style="font-style:normal">{number}</i> <small>rad</small>'


def _big(run: LoopRun) -> str:
    number = escape(significant(1e3 * run.tracking.hit_position))
    return f'<i class="coloured {COLOURS[run.source]}" style="font-style:normal">{number}</i> <small>mm</small>'
