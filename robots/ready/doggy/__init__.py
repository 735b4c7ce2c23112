# SPDX-License-Identifier: BSD-3-Clause
"""The ready robot Doggy, after Schuethe, Wenk and Frese (2016)."""
