# SPDX-License-Identifier: BSD-3-Clause
"""A recording fed to the estimator in the order of its arrival.

In: arrivals. Out: `ReplayResult`: states and innovations by tick, latencies, consistency, agreement with the batch.
"""
