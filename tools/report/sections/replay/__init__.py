# SPDX-License-Identifier: BSD-3-Clause
"""Sections about a replay of the estimator: innovations, consistency, latency, states."""
