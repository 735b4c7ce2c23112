# SPDX-License-Identifier: BSD-3-Clause
"""Bags and messages byte by byte.

In: a file. Out: columns of numbers, by the fast way where all messages look alike, else one by one.
"""
