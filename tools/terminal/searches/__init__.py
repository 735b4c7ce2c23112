# SPDX-License-Identifier: BSD-3-Clause
"""Searches for effects without motion, on one screen: a discovery in, its steps and ranking out."""
