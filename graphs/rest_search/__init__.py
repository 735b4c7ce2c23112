# SPDX-License-Identifier: BSD-3-Clause
"""What a model lacks at rest: calibrated rests in, effects judged on groups of rests left out; models grown."""
