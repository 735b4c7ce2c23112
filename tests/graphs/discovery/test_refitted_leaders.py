# SPDX-License-Identifier: BSD-3-Clause
"""Which candidates are refitted: those that ran away said nothing, and take no place of those that may be right."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from jointscope.graphs.discovery import diagnose as module
from jointscope.graphs.discovery.diagnose import MOST_REFITS, PATIENCE
from jointscope.graphs.refits.validated_refit import ValidatedRefit

BEFORE = 10.0  # [sigma] error of the base model


def tried(monkeypatch, errors, leaders=3):
    """Numbers of the candidates that were refitted; errors after each refit, None for one that ran away."""
    monkeypatch.setattr(module.LeftOut, "of", staticmethod(lambda base, spans: None))
    candidates = [
        SimpleNamespace(label=str(k), plausible=1000.0 - k, chance=0.0, best=SimpleNamespace(dof=1, number=k))
        for k in range(len(errors))
    ]

    def in_order(function, shared, tasks):
        for task in tasks:
            error = errors[task.number]
            yield None if error is None else ValidatedRefit(None, SimpleNamespace(error=error))

    scored, pool = SimpleNamespace(candidates=candidates, placebo=0.0), SimpleNamespace(in_order=in_order)
    found = module._refit_leaders(None, scored, BEFORE, ((), ()), None, leaders, lambda text, share: None, pool)
    return [int(label) for label in found]


@pytest.mark.parametrize("lost", [1, 2, 3])
def test_those_that_ran_away_do_not_keep_the_right_one_from_its_turn(monkeypatch, lost):
    errors = [11.0, 11.0, 11.0, *[None] * lost, 11.0, 11.0, 5.0, 11.0, 11.0]
    assert tried(monkeypatch, errors) == list(range(6 + lost))


def test_where_one_helps_the_leaders_are_enough(monkeypatch):
    assert tried(monkeypatch, [9.0, 11.0, 11.0, 11.0]) == [0, 1, 2]
    assert tried(monkeypatch, [11.0, 11.0, 11.0, 9.0, 11.0]) == [0, 1, 2, 3]


def test_a_catalogue_that_runs_away_comes_to_an_end(monkeypatch):
    assert len(tried(monkeypatch, [None] * 40)) == MOST_REFITS * 3
    assert len(tried(monkeypatch, [11.0] * 40)) == PATIENCE * 3
