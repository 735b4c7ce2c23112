# SPDX-License-Identifier: BSD-3-Clause
"""What is plainly wrong before anything is estimated: recordings and a robot in, sentences with what to type out.

Signals of joints that are exchanged, and drives that saturate, leave a shape in a regression that no effect has.
"""
