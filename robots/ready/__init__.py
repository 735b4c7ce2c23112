# SPDX-License-Identifier: BSD-3-Clause
"""Robots that come with the package, a folder each: YAML with sources on its lines, and the URDF."""
