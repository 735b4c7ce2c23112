# SPDX-License-Identifier: BSD-3-Clause
"""Sections about closed loops: hits, errors, commands, what the controller knew."""
