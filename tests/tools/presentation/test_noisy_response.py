# SPDX-License-Identifier: BSD-3-Clause
"""A response that tells little says why, as far as the recording shows it; one that tells much says nothing."""

from __future__ import annotations

import numpy as np
from ringing_masses import ringing

from jointscope.graphs.responses.find_excitation import find_excitation
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.graphs.responses.settled_periods import settled
from jointscope.tools.presentation.noisy_response import noise_doubt
from jointscope.tools.terminal.responses_text import response_text


def measured(signals):
    return MeasuredResponse.of(signals, settled(signals, find_excitation(signals.inputs, 1, "made")))


def test_lines_above_half_the_rate_of_the_samples_are_told():
    found = measured(ringing(np.arange(1, 900, 2), every=4))
    assert "the lines go up to 124.5 Hz, half the rate of the samples" in noise_doubt(found)
    assert "Record at more than twice the highest excited frequency" in response_text(found)


def test_a_good_response_is_not_doubted():
    found = measured(ringing(np.arange(1, 240, 2), every=4))
    assert not noise_doubt(found)
    assert "without the first period of each experiment, in which the response had not settled" in response_text(found)


def test_an_output_that_is_noise_has_likely_reasons():
    said = noise_doubt(measured(ringing(np.arange(1, 240, 2), noise=1e-2)))
    assert "the output changes from period to period" in said and "half the rate" not in said
