# SPDX-License-Identifier: BSD-3-Clause
"""A first robot file from a URDF and a bag: what is recorded where, what sits on which link, which way it turns."""
