# SPDX-License-Identifier: BSD-3-Clause
"""How each kind of effect would change the residuals: one column of derivatives for each size.

In: a hypothesis and the motion at the estimate. Out: its columns.
"""
