# SPDX-License-Identifier: BSD-3-Clause
"""What rigid joints lack, by regression of each joint alone.

In: a calibrated robot and its recordings. Out: of a load that changes, links that weigh something else, drives whose
gain falls, friction and effects of the catalogue the one that explains the torque that is left.
"""
