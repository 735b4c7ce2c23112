# SPDX-License-Identifier: BSD-3-Clause
"""Scores what a model might lack, without fitting it.

In: a solved problem and hypotheses: an effect at an owner with its shapes. Out: the size that the residuals ask for,
and how significant it is.
"""
