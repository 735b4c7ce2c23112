# SPDX-License-Identifier: BSD-3-Clause
"""Ready robot: axes 1 to 3 of a KUKA KR300 R2500 with secondary encoders."""
