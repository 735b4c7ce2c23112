# SPDX-License-Identifier: BSD-3-Clause
"""Robots and effects in files.

In: YAML, Python files of users, the catalogue in `effects/`. Out: robots, robots written back with their comments kept,
effects added and removed.
"""
