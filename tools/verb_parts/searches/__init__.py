# SPDX-License-Identifier: BSD-3-Clause
"""`diagnose` and `discover` of arms without recordings of motion."""
