# SPDX-License-Identifier: BSD-3-Clause
"""Bags and tables of robots that stand at poses, or are shaken there, in; poses, rests and shaken poses out."""
