# SPDX-License-Identifier: BSD-3-Clause
"""What a robot is made of besides its bodies: parameters, sensors, choices of the model, layout of its state."""
