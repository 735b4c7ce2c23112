# SPDX-License-Identifier: BSD-3-Clause
"""Springs and dampers of an arm from frequency responses: shaken poses in; stiffnesses with sigmas out."""
