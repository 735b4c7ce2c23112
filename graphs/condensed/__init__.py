# SPDX-License-Identifier: BSD-3-Clause
"""Recordings as a `gtsam.NonlinearFactorGraph` of a few dozen factors: problems in, graph, values and steps out."""
