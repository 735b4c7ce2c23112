# SPDX-License-Identifier: BSD-3-Clause
"""Several kinds of recordings of an arm in one estimate: frequency responses, poses, rests; one robot file out."""
