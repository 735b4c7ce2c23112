# SPDX-License-Identifier: BSD-3-Clause
"""Messages as they come, late, doubled or not at all.

In: messages. Out: samples at their ticks, and events that say what was wrong with them.
"""
