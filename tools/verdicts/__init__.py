# SPDX-License-Identifier: BSD-3-Clause
"""Is a result good? Checks with limits, each with a sentence, and the verdict that follows from them."""
