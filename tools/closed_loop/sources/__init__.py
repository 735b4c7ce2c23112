# SPDX-License-Identifier: BSD-3-Clause
"""Ways of knowing the state, one per file; `state_sources` names them."""
