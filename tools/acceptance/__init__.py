# SPDX-License-Identifier: BSD-3-Clause
"""Whether a result keeps the limits that a user has declared.

In: a file of limits with reasons, and what a verb writes as JSON. Out: pass, fail or not evaluated, line by line.
"""
