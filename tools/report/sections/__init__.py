# SPDX-License-Identifier: BSD-3-Clause
"""The sections of the reports, one per file: each takes a result and returns a Section."""
