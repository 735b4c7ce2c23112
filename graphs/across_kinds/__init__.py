# SPDX-License-Identifier: BSD-3-Clause
"""What a model lacks, asked of several kinds of recordings: the verdict of each in, one ranking of all effects out."""
