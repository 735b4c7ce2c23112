# SPDX-License-Identifier: BSD-3-Clause
"""What `simulate` writes of each kind of recording."""
