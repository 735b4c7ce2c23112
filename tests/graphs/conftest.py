# SPDX-License-Identifier: BSD-3-Clause
"""A discovery that several tests look at."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace

import pytest

HIDDEN, COEFFICIENT = "load_dependent_friction@joint2", 0.25


@pytest.fixture(scope="session")
def discovered(doggy):
    """Three seconds of a Doggy whose friction on joint 2 grows with the load, discovered with one refit per round.

    The search starts at the true values of all other parameters, so that calibrations are quick.
    """
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.graphs.discovery import discover
    from jointscope.tools.simulator import simulate

    effect = f"{HIDDEN}:coefficient={COEFFICIENT}"
    train = simulate(doggy, "calibration", 3.0, seed=5, friction="smooth", effects=[effect]).recording
    test = simulate(doggy, "moves", 2.0, seed=5, friction="smooth", effects=[effect]).recording
    near = doggy.with_values({name: p.published for name, p in doggy.parameters.items() if p.published is not None})
    saved = []

    def save(number, step):
        saved.append((number, step.label))
        return f"step{number}.yaml"

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(discover, "diagnose", partial(discover.diagnose, leaders=1))
        result = discover.discover(near, [train], test, save=save)
    return SimpleNamespace(result=result, saved=saved, label=HIDDEN, coefficient=COEFFICIENT)
