# SPDX-License-Identifier: BSD-3-Clause
"""What a recording is, and whether it can be one of this robot.

In: streams of samples. Out: the recording screened, with notices that say what looked odd and where.
"""
