# SPDX-License-Identifier: BSD-3-Clause
"""URDFs as their makers ship them.

In: a file. Out: its bodies and joints, which joint follows which, and its elements to be changed and written again.
"""
