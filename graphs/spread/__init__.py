# SPDX-License-Identifier: BSD-3-Clause
"""Recordings spread over workers, each of which keeps its own.

In: a crew of workers, problems and an estimate. Out: a solution as of one process but for rounding: workers get shared
values and the ends of stretches, and send the small Hessians that are left.
"""
