#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# gtsam 4.3.0: Diagonal.Sigmas makes a constrained noise model as soon as one sigma is below 1e-8, not only where it is zero.
# Its factors then are weighted as the sigma says, but the linearised graph has no Hessian any more (hessian() raises a ValueError),
# and elimination takes QR where it took Cholesky. Isotropic.Sigma and Diagonal.Sigmas(..., False) keep the same sigma.
# In SI units that is met without any wish for a constraint: positions in a step of a millisecond, nanometres of an
# interferometer, farads. What helps: whiten by oneself and give the factor the unit model; factors/single.py does so.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip --quiet --disable-pip-version-check install "gtsam==4.3.0" "numpy==2.4.6"
"$folder/venv/bin/python" - <<'PYTHON'
import gtsam
import numpy as np

Sigmas = gtsam.noiseModel.Diagonal.Sigmas


def graph_of(model: gtsam.noiseModel.Diagonal) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
    """A value near 1e-8 seen by this model, and once more with a sigma of 2e-8."""
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    values.insert(0, np.zeros(2))
    graph.add(gtsam.PriorFactorVector(0, np.array([1e-8, 0.0]), model))
    graph.add(gtsam.PriorFactorVector(0, np.array([3e-8, 0.0]), Sigmas(np.array([2e-8, 1.0]))))
    return graph, values


for sigma, constrained in ((2e-8, False), (1.1e-8, False), (0.9e-8, True), (1e-9, True)):
    model = Sigmas(np.array([sigma, 1.0]))
    graph, values = graph_of(model)
    linear = graph.linearize(values)
    try:
        linear.hessian()
        hessian = "there"
    except ValueError as err:
        hessian = str(err)
    print(f"sigma {sigma:g}: {type(model).__name__}, Hessian: {hessian}")
    assert model.isConstrained() is constrained
    assert (hessian == "there") is not constrained
    weights = np.array([1.0 / sigma**2, 1.0 / 2e-8**2])
    mean = float(weights @ [1e-8, 3e-8] / weights.sum())
    assert np.isclose(linear.optimize().at(0)[0], mean, rtol=1e-6)  # weighted, not held

assert not gtsam.noiseModel.Isotropic.Sigma(2, 1e-9).isConstrained()
assert not Sigmas(np.array([1e-9, 1.0]), False).isConstrained()
print("gtsam 4.3.0 behaves as described")
PYTHON
