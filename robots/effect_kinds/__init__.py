# SPDX-License-Identifier: BSD-3-Clause
"""The ways in which a physical effect can enter a model: torque at a joint, reading, command, inertia, structure, time.

In: nothing of a robot. Out: base classes that a file in `effects/` fills in, and an effect at its owner.
"""
