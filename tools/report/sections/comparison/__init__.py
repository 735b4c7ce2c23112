# SPDX-License-Identifier: BSD-3-Clause
"""Sections that hold models against a recording."""
