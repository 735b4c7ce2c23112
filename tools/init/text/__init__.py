# SPDX-License-Identifier: BSD-3-Clause
"""What was found, as the text of a robot file with a reason on each line, and as tables."""
