# SPDX-License-Identifier: BSD-3-Clause
"""Where drives begin, by linear regression in a second: positions and commands in, values with sigmas out.

In: a rigid tree, the streams of encoders and commands, the noise of the encoders. `motion_cells` averages both over
short equal cells, `windowed_sums` weighs the cells with smooth windows, `drive_regression` solves joint by joint.
Out: one `DriveFit` for each joint. `jointscope init` writes them down, `calibrate` begins at them.
"""
