# SPDX-License-Identifier: BSD-3-Clause
"""Effects that one ready robot alone has, such as a misprint of its paper; no catalogue and no search offers them."""
