# SPDX-License-Identifier: BSD-3-Clause
"""Results as text on a terminal, tables, and a progress bar."""
