# SPDX-License-Identifier: BSD-3-Clause
"""Models against a recording.

In: robots and a recording. Out: errors of free runs and of predictions from horizon to horizon, beside the floor that
noise alone would leave, and where and when a model fails.
"""
