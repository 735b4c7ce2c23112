# SPDX-License-Identifier: BSD-3-Clause
"""The missing torque against velocity, position, deflection and load: the shape of what the model lacks."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.discovery.missing_torque import MissingTorque
from jointscope.graphs.discovery.residual_maps import ResidualMap, residual_maps
from jointscope.tools.presentation.numbers import percent
from jointscope.tools.report.page.page import Key, Section, figure, foldable
from jointscope.tools.report.page.plot import Axes, Band, Curve, Mark, plot

TELLING = 6  # maps shown at once
LITTLE = 0.02  # share of the variance below which a map shows nothing
FEWEST = 3  # maps shown where none shows anything
COLOURS = ("m1", "m2", "m3", "m4", "m5")  # of the candidates
NOT_ESTIMATED = "<p>The missing torque was not estimated.</p>"


def torque_maps(
    missing: MissingTorque | None, id_: str = "maps", title: str = "The shape of what is missing"
) -> Section:
    """The most telling maps, then all others of a joint against its own signals."""
    lead = (
        "The torque that each equation of motion lacks, estimated as a lasting one, against what may cause it. Line: "
        "median, band: middle half of the samples. In colour: what the best candidates would add. A flat line at zero "
        "is good. The percentage is the part of the torque's variance that follows the signal, beyond chance."
    )
    if missing is None:
        return Section(id_, title, NOT_ESTIMATED, lead)
    maps = residual_maps(missing)
    if not maps:
        return Section(id_, title, "<p>Nothing moved enough to show a shape.</p>", lead)
    keys = [Key("missing torque", "m0"), Key("middle half", "m0", "band"), *candidate_keys(missing)]
    first = most_telling(maps)
    rest = sorted((m for m in maps if m.own and m not in first), key=lambda m: (missing.rows.index(m.row), m.signal))
    body = _grid(first, missing, keys)
    body += foldable(f"{len(rest)} more maps, each joint against its own signals", _grid(rest, missing, keys))
    return Section(id_, title, body, lead)


def most_telling(maps: list[ResidualMap], count: int = TELLING) -> list[ResidualMap]:
    """The first maps; of deflection and load of one joint, which are nearly the same, only the better one."""
    chosen: dict[tuple[str, str], ResidualMap] = {}
    for m in maps:
        chosen.setdefault((m.row, m.signal.replace("load", "deflection")), m)
    first = list(chosen.values())[:count]
    return [m for m in first if m.telling >= LITTLE] or first[:FEWEST]


def candidate_keys(missing: MissingTorque) -> list[Key]:
    """Legend entries of the candidates whose torque is known."""
    return [Key(label, candidate_colour(missing, label), "dashed") for label in missing.explained_by]


def candidate_colour(missing: MissingTorque, label: str) -> str:
    """Colour class of a candidate, the same in every plot."""
    return COLOURS[list(missing.explained_by).index(label) % len(COLOURS)]


def _grid(maps: list[ResidualMap], missing: MissingTorque, keys: list[Key]) -> str:
    panels = "".join(map_picture(m, missing) for m in maps)
    return figure([f'<div class="maps">{panels}</div>'], keys)


def map_picture(m: ResidualMap, missing: MissingTorque) -> str:
    """One map."""
    marks: list[Mark] = [
        Band("middle half", m.centers, m.low, m.high, "m0"),
        Curve("missing torque", m.centers, m.median, "m0", "thick"),
    ]
    marks += [
        Curve(label, m.centers, y, candidate_colour(missing, label), "dashed") for label, y in m.explained.items()
    ]
    marks.append(Curve("", m.centers, np.zeros(len(m.centers)), "soft", "hair"))
    axes = Axes(f"{m.row} [{m.torque_unit}], {percent(max(m.telling, 0.0))}", f"{m.signal} [{m.unit}]", 360, 230)
    return plot(axes, marks)
