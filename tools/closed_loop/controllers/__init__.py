# SPDX-License-Identifier: BSD-3-Clause
"""Laws that turn a state into a command, one per file; `control_laws` names them."""
