# SPDX-License-Identifier: BSD-3-Clause
"""Rests in; what speaks against a calibration from them, alone or beside motion, and what they leave open, out."""
