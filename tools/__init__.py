# SPDX-License-Identifier: BSD-3-Clause
"""The outside world: bags, command line, report, rerun, simulator.

Rooms in the order of their imports: writing, bags, simulator, closed_loop, init, presentation, terminal, report,
rerun_log, verb_parts, verbs.
"""
