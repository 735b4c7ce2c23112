# SPDX-License-Identifier: BSD-3-Clause
"""The sections of the reports, one file each, in a room for each kind of result."""
