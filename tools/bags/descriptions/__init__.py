# SPDX-License-Identifier: BSD-3-Clause
"""A bag in, what it holds out: topics with their rates, and whether a robot can use it as motion or as rests."""
