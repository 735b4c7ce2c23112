# SPDX-License-Identifier: BSD-3-Clause
"""Recordings in which springs are locked: in go readings of motors and links, out comes the matrix between them."""
