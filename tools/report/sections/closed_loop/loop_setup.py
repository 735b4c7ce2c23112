# SPDX-License-Identifier: BSD-3-Clause
"""How it was done, so that nobody has to guess: plan, laws, sources, and where model and truth differ."""

from __future__ import annotations

from html import escape

from jointscope.tools.closed_loop.closed_loop_result import ClosedLoopResult
from jointscope.tools.closed_loop.planning.hitting_plan import COMMAND_SHARE
from jointscope.tools.closed_loop.planning.optimal_gains import WORTH_FULL_COMMAND
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.page import Section, foldable, listed, table
from jointscope.tools.simulator.loop.controller import GAIN


def loop_setup(result: ClosedLoopResult) -> Section:
    """Sentences, then the parameters of the truth and of the model below a fold."""
    sampling = result.truth["sampling"]
    angle, speed = WORTH_FULL_COMMAND
    sentences = [
        "The plan: random places and directions; polynomials of degree 7 in joint space, within the joints' limits, as "
        f"fast as {100 * COMMAND_SHARE:g} % of the full command allow by the true robot's equations of motion without "
        "its hidden effects.",
        f"P-controller: {GAIN:g} times the full command per rad of planned link angle − motor angle, clipped at the "
        "full command. It uses nothing else of the state.",
        "State feedback: command and state with which the model moves as planned, and a linear-quadratic regulator "
        f"about them, gains from the model at poses 50 ms apart; {angle:g} rad or {speed:g} rad/s of a link are worth "
        "the full command. Nothing is tuned to a robot.",
        "The true state: links, motors, and the tilt of bearings that the model has, as they are in the simulator.",
        f"Estimator: fixed lag {result.lag:g} s, fed with every sample as it arrives, predicted to the tick.",
        f"Encoders: last reading; velocity from differences behind a first-order low-pass of {result.cutoff:g} Hz; the "
        "link is where the planned stretch of the spring puts it, which is better than taking it to be at the motor.",
        f"Sensors: encoders {sampling['encoder_rate']:g} Hz, gyros {sampling['gyro_rate']:g} Hz, mean transport "
        f"delay {1e3 * sampling['transport_delay']:g} ms, {100 * sampling['drop']:g} % "
        "lost. The controllers tick at 1 kHz.",
    ]
    steps = listed(map(escape, sentences), "steps")
    return Section("setup", "How it was done", f"{steps}{_parameters(result)}")


def _parameters(result: ClosedLoopResult) -> str:
    true = result.truth["parameters"]
    rows = []
    for parameter in result.model.parameters.values():
        value = true.get(parameter.name)
        off = f"{100 * (parameter.value / value - 1):+.1f} %".replace("-", "−") if value else "—"
        told = significant(value, 4) if isinstance(value, float) else "not in the truth"
        rows.append(
            [f"<code>{escape(parameter.name)}</code>", told, significant(parameter.value, 4), off, parameter.unit]
        )
    for effect in result.truth["effects"]:
        for name, value in effect["parameters"].items():
            full = f"{effect['owner']}.{effect['effect']}.{name}"
            if full not in result.model.parameters:
                rows.append([f"<code>{escape(full)}</code>", significant(value, 4), "unknown", "—", ""])
    return foldable("Parameters: true and known", table(["parameter", "true", "known", "off", "unit"], rows, [1, 2, 3]))
