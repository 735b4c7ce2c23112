# SPDX-License-Identifier: BSD-3-Clause
"""How each kind of effect makes the columns of its trial."""
