# SPDX-License-Identifier: BSD-3-Clause
"""Sections about what is missing: ranking, verdicts, missing torque, the way the error fell."""
