# SPDX-License-Identifier: BSD-3-Clause
"""Gravity of a base that does not stand as the model thinks: turned about the two level axes.

    g(x, y) = Exp(x e_x + y e_y) g_0 = cos(t) g_0 + sin(t)/t w x g_0,   w = x e_x + y e_y,   t = |w|

with e_x, e_y the coordinate axes of the base that lie most across g_0, in order, as far as they are level.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SMALL = 1e-4  # [rad] below which series of t are exact to rounding


def turned_gravity(gravity: Array, angles: Array) -> tuple[Array, Array]:
    """Gravity after a turn.

    Args:
        gravity: as the model has it, shape (3,) [m/s^2].
        angles: x and y, shape (2,) [rad].

    Returns:
        Shape (3,) [m/s^2], and its derivatives by both angles, shape (2, 3).
    """
    axes = level_axes(gravity)
    w = angles @ axes
    t = float(np.linalg.norm(w))
    sinc = np.sin(t) / t if t > SMALL else 1.0 - t**2 / 6.0
    bend = (np.cos(t) - sinc) / t**2 if t > SMALL else -1.0 / 3.0 + t**2 / 30.0  # (d sinc / dt) / t
    across = np.cross(w, gravity)
    slopes = sinc * np.cross(axes, gravity) + np.outer(angles, bend * across - sinc * gravity)
    return np.cos(t) * gravity + sinc * across, slopes


def level_axes(gravity: Array) -> Array:
    """Two unit vectors across gravity, shape (2, 3)."""
    down = gravity / np.linalg.norm(gravity)
    first, second = np.sort(np.argsort(np.abs(down))[:2])
    x = np.eye(3)[first] - down * down[first]
    x /= np.linalg.norm(x)
    y = np.eye(3)[second] - down * down[second]
    y -= x * (x @ y)
    return np.vstack([x, y / np.linalg.norm(y)])
