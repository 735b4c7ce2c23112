#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# gtsam 4.3.0: a NonlinearFactorGraph with one CustomFactor in it cannot be cloned (RuntimeError, "no clone() implemented"), nor
# copied by copy.deepcopy or serialized ("unregistered class"), though it can be solved; with GTSAM's own factors all three
# work. NonlinearFactorGraph(graph) gives a second graph that shares the factors: adding to it leaves the first as it is.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip --quiet --disable-pip-version-check install "gtsam==4.3.0" "numpy==2.4.6"
"$folder/venv/bin/python" - <<'PYTHON'
import copy

import gtsam
import numpy as np

KEY, UNIT = 1, gtsam.noiseModel.Unit.Create(2)


def away_from_one(this, values, H):
    if H is not None:
        H[0] = np.asfortranarray(np.eye(2))
    return values.atVector(KEY) - 1.0


def graph_of(factor):
    graph = gtsam.NonlinearFactorGraph()
    graph.add(factor)
    return graph


def said(work):
    try:
        return type(work()).__name__
    except RuntimeError as err:
        return str(err)


ways = {"clone": lambda g: g.clone(), "deepcopy": copy.deepcopy, "serialize": lambda g: g.serialize()}
own = {name: said(lambda: way(graph_of(gtsam.PriorFactorVector(KEY, np.ones(2), UNIT)))) for name, way in ways.items()}
custom = {name: said(lambda: way(graph_of(gtsam.CustomFactor(UNIT, [KEY], away_from_one)))) for name, way in ways.items()}
print("GTSAM's own factor:", own)
print("a custom factor:   ", custom)
assert own == {"clone": "NonlinearFactorGraph", "deepcopy": "NonlinearFactorGraph", "serialize": "str"}
assert "no clone() implemented" in custom["clone"]
assert "unregistered class" in custom["deepcopy"] and "unregistered class" in custom["serialize"]

first = graph_of(gtsam.CustomFactor(UNIT, [KEY], away_from_one))
second = gtsam.NonlinearFactorGraph(first)
second.add(gtsam.PriorFactorVector(KEY, 3.0 * np.ones(2), UNIT))
start = gtsam.Values()
start.insert(KEY, np.zeros(2))
ends = [gtsam.LevenbergMarquardtOptimizer(g, start).optimize().atVector(KEY) for g in (first, second)]
print("solved:", ends)
assert first.size() == 1 and np.allclose(ends[0], 1.0) and np.allclose(ends[1], 2.0)
PYTHON
