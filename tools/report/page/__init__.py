# SPDX-License-Identifier: BSD-3-Clause
"""One HTML page without outside references: its frame, plots as SVG, tables, what every report holds."""
