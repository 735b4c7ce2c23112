# SPDX-License-Identifier: BSD-3-Clause
"""Pieces of a recording for the viewer: lines, pictures, documents, the moving robot."""
