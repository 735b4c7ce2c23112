# SPDX-License-Identifier: BSD-3-Clause
"""Dots are dots: nothing is drawn between them."""

from __future__ import annotations

import re

import numpy as np

from jointscope.tools.report.page.plot import Axes, Curve, plot


def drawn(style: str) -> str:
    x = np.linspace(0.0, 1.0, 11)
    svg = plot(Axes("title"), [Curve("cloud", x, x**2, "k0", style)])
    (path,) = re.findall(r'data-name="cloud" d="([^"]*)"', svg)
    return path


def test_each_dot_stands_alone():
    assert re.fullmatch(r"(?:M\d+ \d+h0){11}", drawn("dots"))


def test_a_line_is_one_stroke():
    assert drawn("solid").count("M") == 1 and "h0" not in drawn("solid")
