# SPDX-License-Identifier: BSD-3-Clause
"""Rests of a robot cut out of a recording.

In: a recording and the loads that hung on the arm. Out: means of each rest, how well they are known, who stands and who
creeps.
"""
