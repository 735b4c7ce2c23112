# SPDX-License-Identifier: BSD-3-Clause
"""Reports of searches for effects without motion: a discovery in, a page out."""
