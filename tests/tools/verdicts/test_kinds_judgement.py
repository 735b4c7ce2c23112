# SPDX-License-Identifier: BSD-3-Clause
"""Poses and frequency responses of different arms are no good calibration, however well each of them fits."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from jointscope.graphs.frequency.agreement import Agreement
from jointscope.tools.verdicts import frequency_judgement as module
from jointscope.tools.verdicts.judgement import Check, Judgement

FITS = Judgement.of([Check("good", "Fits", "It does.")])


@pytest.mark.parametrize(("chi2", "level"), [(137.0, "bad"), (18.0, "good")])
def test_kinds_that_contradict_each_other_are_no_yes(monkeypatch, chi2, level):
    monkeypatch.setattr(module, "judge_poses", lambda poses: FITS)
    monkeypatch.setattr(module, "judge_frequency", lambda frequency: FITS)
    found = module.judge_kinds(SimpleNamespace(agreement=Agreement(chi2, 20), poses=None, frequency=None))
    assert found.level == level and len(found.checks) == 3
    assert ("contradict each other: chi-square 137 for 20 directions" in found.answer) is (level == "bad")


def test_what_one_kind_says_against_itself_stays(monkeypatch):
    bad = Judgement.of([Check("bad", "Settled", "It does not.")])
    monkeypatch.setattr(module, "judge_poses", lambda poses: FITS)
    monkeypatch.setattr(module, "judge_frequency", lambda frequency: bad)
    assert module.judge_kinds(SimpleNamespace(agreement=Agreement(1.0, 2), poses=0, frequency=0)).level == "bad"
