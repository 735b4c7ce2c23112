# SPDX-License-Identifier: BSD-3-Clause
"""Ready robot: BioRob, an arm with four rope drives."""
