# SPDX-License-Identifier: BSD-3-Clause
"""The robot in MuJoCo: its model, its drives, hooks for what effects change."""
