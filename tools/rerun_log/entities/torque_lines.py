# SPDX-License-Identifier: BSD-3-Clause
"""The missing torque over time with its band, and against what may cause it, in the viewer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.discovery.missing_torque import MissingTorque
from jointscope.graphs.discovery.residual_maps import ResidualMap, residual_maps
from jointscope.tools.report.sections.diagnosis.torque_maps import most_telling
from jointscope.tools.rerun_log.entities.columns import GREY, JOINT_COLOURS, WHITE, Colour, send_band, send_lines
from jointscope.tools.rerun_log.entities.tab_contents import plot_columns, plot_view
from jointscope.tools.rerun_log.entities.viewer_text import entity, viewer_text

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

Array = NDArray[np.float64]

MISSING = JOINT_COLOURS[2]
CANDIDATES = (JOINT_COLOURS[0], JOINT_COLOURS[1], *JOINT_COLOURS[3:])
WIDTH, HEIGHT = 4.0, 3.0  # of a map; the viewer has no axes of its own for it
MAPS = 6


def send_torque(stream: rr.RecordingStream, missing: MissingTorque, root: str) -> None:
    """Entities ROOT/torque/ROW and ROOT/maps/N."""
    for i, row in enumerate(missing.rows):
        path, t = entity(root, "torque", row), missing.times
        send_lines(stream, f"{path}/missing", t, missing.torque[:, i : i + 1], ["missing torque"], [MISSING], 1.4)
        send_band(
            stream, f"{path}/band", t, 0.0 * missing.sigma[:, i : i + 1], 3.0 * missing.sigma[:, i : i + 1], [WHITE]
        )
        curves = {label: curve[:, i] for label, curve in missing.explained_by.items() if np.any(curve[:, i])}
        if curves:
            colours = [_colour(missing, label) for label in curves]
            send_lines(stream, f"{path}/explained", t, np.column_stack(list(curves.values())), list(curves), colours)
    for k, m in enumerate(_maps(missing)):
        _send_map(stream, entity(root, "maps", str(k + 1)), m, missing)


def torque_views(missing: MissingTorque, root: str, name: str) -> list[rrb.Container]:
    """A tab over time, and one against the signals."""
    import rerun.blueprint as rrb

    n = len(missing.joints)
    columns = [
        [plot_view(f"{row} [{missing.unit(row, 'N m')}]", root, "torque", row) for row in side]
        for side in (missing.rows[:n], missing.rows[n : 2 * n])
    ]
    bounds = rrb.VisualBounds2D(x_range=(-0.15 * WIDTH, 1.15 * WIDTH), y_range=(-0.2 * HEIGHT, 1.2 * HEIGHT))
    maps = [
        rrb.Spatial2DView(
            origin="/" + entity(root, "maps", str(k + 1)),
            name=viewer_text(f"{m.row} over {m.signal}"),
            visual_bounds=bounds,
        )
        for k, m in enumerate(_maps(missing))
    ]
    tabs: list[rrb.Container] = [plot_columns(columns, viewer_text(f"missing torque{name}"))]
    if maps:
        tabs.append(
            rrb.Grid(*maps, grid_columns=3, name=viewer_text(f"its shape: blue median, grey middle half{name}"))
        )
    return tabs


def torque_bytes(missing: MissingTorque | None) -> int:
    """About how much it takes [byte]."""
    return 0 if missing is None else 8 * missing.torque.size * (4 + len(missing.explained_by))


def _maps(missing: MissingTorque) -> list[ResidualMap]:
    return most_telling(residual_maps(missing), MAPS)


def _colour(missing: MissingTorque, label: str) -> Colour:
    return CANDIDATES[list(missing.explained_by).index(label) % len(CANDIDATES)]


def _send_map(stream: rr.RecordingStream, path: str, m: ResidualMap, missing: MissingTorque) -> None:
    """Lines of the median, the quartiles and the candidates in a frame with its limits written beside it."""
    import rerun as rr

    curves = [(m.low, GREY, 1.0), (m.high, GREY, 1.0), (m.median, MISSING, 2.5)]
    curves += [(y, _colour(missing, label), 1.5) for label, y in m.explained.items()]
    every = np.concatenate([y for y, _, _ in curves] + [np.zeros(1)])
    low, high = float(every.min()), float(every.max())
    left, right = float(m.centers[0]), float(m.centers[-1])

    def place(x: Array, y: Array) -> Array:
        return np.column_stack([WIDTH * (x - left) / (right - left), HEIGHT * (high - y) / max(high - low, 1e-12)])

    def lines(strips: list[Array], colours: list[Colour], widths: list[float]) -> rr.LineStrips2D:
        return rr.LineStrips2D(strips, colors=colours, radii=rr.Radius.ui_points(widths))

    frame = [np.array([[0, 0], [WIDTH, 0], [WIDTH, HEIGHT], [0, HEIGHT], [0, 0]], dtype=float)]
    zero = [place(np.array([left, right]), np.zeros(2))]
    stream.log(f"{path}/frame", lines(frame + zero, [(70, 76, 84)] * 2, [0.6, 0.6]), static=True)
    strips = [place(m.centers, y) for y, _, _ in curves]
    stream.log(f"{path}/lines", lines(strips, [c for _, c, _ in curves], [w for _, _, w in curves]), static=True)
    texts = {
        (0.0, -0.12 * HEIGHT): f"{high:.3g} {m.torque_unit}",
        (0.0, HEIGHT + 0.05): f"{low:.3g} {m.torque_unit} at {m.signal} = {left:.3g} {m.unit}",
        (WIDTH, HEIGHT + 0.05): f"{right:.3g} {m.unit}",
    }
    labels = rr.Points2D(
        list(texts), labels=[viewer_text(text) for text in texts.values()], radii=0.0, colors=[GREY], show_labels=True
    )
    stream.log(f"{path}/limits", labels, static=True)
