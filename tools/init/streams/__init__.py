# SPDX-License-Identifier: BSD-3-Clause
"""Which stream is what: roles, names, order, noise, joints that stand still."""
