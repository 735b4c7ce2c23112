# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of reports as PDF, for papers: an SVG file in, a page of vectors out, drawn by matplotlib."""
