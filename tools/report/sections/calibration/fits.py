# SPDX-License-Identifier: BSD-3-Clause
"""Measured against predicted as in Figs. 5 to 8 of the paper, the whole recording and a closer look."""

from __future__ import annotations

from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult
from jointscope.tools.presentation.sensor_signals import COLOURS, SignalRow, liveliest, points_per_curve, signal_rows
from jointscope.tools.report.page.page import Key, Section, figure
from jointscope.tools.report.page.panels import below_each_other
from jointscope.tools.report.page.plot import Axes, Curve
from jointscope.tools.report.sections.calibration.per_bag import per_bag


def fits(result: CalibrationResult) -> Section:
    """Motor position, motor velocity and gyros over time."""
    points = points_per_curve(result.bags)

    def draw(bag: BagFit, group: str) -> str:
        rows = signal_rows(result, bag)
        t0, t1 = liveliest(bag.ticks, bag.states[:, result.robot.layout.motor_v])
        whole = _panels(rows, (float(bag.ticks[0]), float(bag.ticks[-1])), 150, points)
        closer = _panels(rows, (t0, t1), 190, points)
        return (
            "<h3>Whole recording</h3>"
            + figure(whole, _keys(rows), "Drag to zoom, double click for the whole range.", group)
            + f"<h3>A closer look: the liveliest {t1 - t0:.1f} s</h3>"
            + figure(
                closer,
                _keys(rows),
                "Measured motor velocity: difference of encoder samples 20 ms apart. Predicted: the estimated state.",
                f"{group} closer",
            )
        )

    lead = (
        "Broad and pale: measured. Dashed: predicted from the smoothed states. The smoother has seen these data; "
        "a comparison on another recording is the harder test."
    )
    return Section("fits", "Measured and predicted", per_bag(result, draw), lead)


def _panels(rows: list[SignalRow], limits: tuple[float, float], height: int, points: int) -> list[str]:
    return below_each_other(
        [
            (
                Axes(f"{row.title} [{row.unit}]", height=height, x_range=limits),
                [*_measured(row, points), *_predicted(row, points)],
            )
            for row in rows
        ]
    )


def _measured(row: SignalRow, points: int) -> list[Curve]:
    return [
        Curve(f"{part} measured", row.times, row.measured[:, i], COLOURS[i % 6], "wide", points)
        for i, part in enumerate(row.parts)
    ]


def _predicted(row: SignalRow, points: int) -> list[Curve]:
    return [
        Curve(f"{part} predicted", row.predicted_times, row.predicted[:, i], COLOURS[i % 6], "dashed", points)
        for i, part in enumerate(row.parts)
    ]


def _keys(rows: list[SignalRow]) -> list[Key]:
    """The components by name, one entry per name, in the order of the rows."""
    seen: dict[str, str] = {}
    for row in rows:
        for i, part in enumerate(row.parts):
            seen.setdefault(part, COLOURS[i % 6])
    kinds = [Key("measured", "soft", "wide"), Key("predicted", "soft", "dashed")]
    return [*(Key(part, colour) for part, colour in seen.items()), *kinds]
