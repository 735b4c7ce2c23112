# SPDX-License-Identifier: BSD-3-Clause
"""The outside world: bags, command line, report, rerun, simulator."""
