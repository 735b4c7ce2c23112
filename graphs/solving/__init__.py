# SPDX-License-Identifier: BSD-3-Clause
"""Least squares over all recordings at once.

In: problems and an estimate. Out: the minimum with its normal equations and covariance: stretches of a recording are
condensed to one GTSAM factor each, the states inside eliminated by a banded factorisation.
"""
