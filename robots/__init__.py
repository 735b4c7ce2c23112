# SPDX-License-Identifier: BSD-3-Clause
"""What a robot is: recording, robot file, rigid tree, sensors, physical effects. No GTSAM, no ROS.

Rooms in the order of their imports: bodies, parts, effect_kinds, model, effects, dynamics, recordings, files, ready.
Loose are only what all of them need: errors, units, sections of YAML, packages that are not the ones meant.
"""
