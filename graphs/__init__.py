# SPDX-License-Identifier: BSD-3-Clause
"""Puts factors together and solves: batch calibration, smoothing, prediction, results with covariance.

Rooms in the order of their imports: problem, solving, gtsam_solvers, noise, starts, scoring, calibration, comparison,
discovery, transmission, fixed_lag.
"""
