# SPDX-License-Identifier: BSD-3-Clause
"""What terminal, report and viewer say alike: numbers, verdicts, answers, sentences.

In: results. Out: texts and numbers without any layout.
"""
