# SPDX-License-Identifier: BSD-3-Clause
"""Loops over ticks as machine code: plain arrays in, plain arrays out. Imported inside the functions that call them."""
