# SPDX-License-Identifier: BSD-3-Clause
"""Robots at rest under gravity and known loads: rests in; springs, friction bands and weights of a calibration out."""
