# SPDX-License-Identifier: BSD-3-Clause
"""Who computes beside this process: local processes, or the workers of a Dask cluster.

In: functions with arguments, and a slot that shall run them. Out: their results; where a worker died, that it did.
"""
