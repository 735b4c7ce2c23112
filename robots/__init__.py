# SPDX-License-Identifier: BSD-3-Clause
"""What a robot is: recording, robot file, rigid tree, sensors, physical effects. No GTSAM, no ROS."""
