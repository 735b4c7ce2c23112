# SPDX-License-Identifier: BSD-3-Clause
"""Independent random numbers per purpose, so that switching one option on leaves all other draws as they were."""

from __future__ import annotations

import zlib

import numpy as np


def random_stream(seed: int, *purpose: str) -> np.random.Generator:
    """A generator that depends on the seed and the purpose only, for example (3, "noise", "imu1")."""
    return np.random.default_rng([seed, zlib.crc32("/".join(purpose).encode())])
