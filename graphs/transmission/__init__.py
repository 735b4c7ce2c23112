# SPDX-License-Identifier: BSD-3-Clause
"""Robots whose links' masses are not known: what motors, links and gyros say about each other all the same."""
