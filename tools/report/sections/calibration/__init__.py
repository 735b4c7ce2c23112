# SPDX-License-Identifier: BSD-3-Clause
"""Sections about a calibration: verdict, parameters, fits, residuals, noise, states."""
