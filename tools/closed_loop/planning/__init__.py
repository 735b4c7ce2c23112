# SPDX-License-Identifier: BSD-3-Clause
"""Where a controlled robot shall go and how well it went: plans, references, gains, tracking errors."""
