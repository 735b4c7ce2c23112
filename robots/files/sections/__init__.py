# SPDX-License-Identifier: BSD-3-Clause
"""Sections of a robot file, one file each.

In: a section of the YAML. Out: the part of a robot that it describes, or a line that says what to write.
"""
