# SPDX-License-Identifier: BSD-3-Clause
"""Correlations as a picture with names and numbers, and the parameters with their sigmas as a text beside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.calibration.found_values import share_of_value
from jointscope.robots.parts.relative_sigma import relative_sigma
from jointscope.tools.presentation.numbers import with_sigma
from jointscope.tools.rerun_log.entities.tab_contents import send_document

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

CELL = 34  # [px]
LETTER = 8  # [px] width of a letter of the names
POSITIVE, NEGATIVE, PAPER = np.array([60.0, 150.0, 225.0]), np.array([235.0, 105.0, 55.0]), np.array([24.0, 28.0, 32.0])


def send_covariance(stream: rr.RecordingStream, result: CalibrationResult) -> None:
    """Entities covariance/correlation and covariance/parameters."""
    import rerun as rr

    if len(result.names):
        stream.log("covariance/correlation", rr.Image(correlation_picture(result)), static=True)
    send_document(stream, "covariance/parameters", parameter_table(result))


def covariance_views() -> rrb.Horizontal:
    """Picture and table side by side."""
    import rerun.blueprint as rrb

    return rrb.Horizontal(
        rrb.Spatial2DView(origin="/covariance/correlation", name="correlation"),
        rrb.TextDocumentView(origin="/covariance/parameters", name="parameters ± sigma"),
        column_shares=[3, 2],
        name="covariance",
    )


def correlation_picture(result: CalibrationResult) -> NDArray[np.uint8]:
    """Heat map of a calibration as pixels, shape (height, width, 3)."""
    return heat_map_pixels(result.names, result.correlation)


def heat_map_pixels(names: Sequence[str], correlation: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Correlations, shape (s, s), as pixels, shape (height, width, 3); rows are named, columns numbered alike."""
    from PIL import Image, ImageDraw, ImageFont

    s = len(names)
    labels = [f"{name}  {i + 1}" for i, name in enumerate(names)]
    left, top = LETTER * max(map(len, labels)) + 16, CELL
    strength = np.clip(np.abs(correlation), 0.0, 1.0)[..., None]
    hue = np.where(correlation[..., None] >= 0.0, POSITIVE, NEGATIVE)
    cells = np.repeat(np.repeat(PAPER + strength * (hue - PAPER), CELL, axis=0), CELL, axis=1)
    pixels = np.full((top + s * CELL + 8, left + s * CELL + 8, 3), PAPER)
    pixels[top : top + s * CELL, left : left + s * CELL] = cells
    image = Image.fromarray(pixels.astype(np.uint8))
    draw, font, small = ImageDraw.Draw(image), ImageFont.load_default(14), ImageFont.load_default(11)
    for i, label in enumerate(labels):
        middle = top + i * CELL + CELL // 2
        draw.text((left - 8, middle), label, fill=(220, 224, 228), font=font, anchor="rm")
        draw.text((left + i * CELL + CELL // 2, top - 8), str(i + 1), fill=(160, 168, 176), font=font, anchor="ms")
        for j in range(s):
            if i != j and abs(correlation[i, j]) >= 0.1:
                number = f"{correlation[i, j]:.2f}".replace("0.", ".")
                at = (left + j * CELL + CELL // 2, middle)
                draw.text(at, number, fill=(245, 247, 249), font=small, anchor="mm")
    return np.asarray(image)


def parameter_table(result: CalibrationResult) -> str:
    """Markdown table of all parameters."""
    lines = ["| parameter | value | ± sigma | relative | unit | note |", "| --- | ---: | ---: | ---: | --- | --- |"]
    for p in result.parameters:
        value, sigma = with_sigma(p.value, p.sigma)
        told = share_of_value(result.robot, p) if p.name in result.robot.parameters else None
        share = "" if told is None else relative_sigma(told, "")
        lines.append(f"| {p.name} | {value} | {sigma} | {share} | {p.unit} | {p.note.replace('|', '/')} |")
    return "\n".join(lines)
