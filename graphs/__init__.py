# SPDX-License-Identifier: BSD-3-Clause
"""Puts factors together and solves: batch calibration, smoothing, prediction, results with covariance."""
