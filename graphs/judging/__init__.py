# SPDX-License-Identifier: BSD-3-Clause
"""Candidates judged by the torque that is missing, where the sensors are better than any model.

In goes a calibrated base model; out come sizes, significance, and shares of the missing torque on blocks left out.
"""
