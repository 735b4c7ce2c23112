# SPDX-License-Identifier: BSD-3-Clause
"""Jointscope: calibrate flexible-joint robots from recordings and see what the model cannot explain."""

from importlib.metadata import version

__version__ = version("jointscope")
