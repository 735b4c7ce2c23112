# SPDX-License-Identifier: BSD-3-Clause
"""Files written whole or not at all, and never over an input."""
