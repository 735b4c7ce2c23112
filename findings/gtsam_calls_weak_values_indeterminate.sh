#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# gtsam 4.3.0: elimination by Cholesky, the default, throws "Indeterminate linear system" for a variable one of whose values is
# known 2^12 times worse beside the others than if those were given: a pivot of the factor at or below 2^-12 of the root of
# its own diagonal element. Units do not matter, the order of the values within the variable does. In double precision the
# same system is solved to eight digits. A state of positions and velocities, one of which friction soon forgets, is such a variable.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip --quiet --disable-pip-version-check install "gtsam==4.3.0" "numpy==2.4.6"
"$folder/venv/bin/python" - <<'PYTHON'
import gtsam
import numpy as np


def solved(R):
    """x of R x = R [1, 1], by GTSAM; None where it refuses."""
    graph = gtsam.GaussianFactorGraph()
    unit = gtsam.noiseModel.Unit.Create(2)
    graph.add(gtsam.JacobianFactor(0, R, 1, np.ones((2, 1)), R @ np.ones(2), unit))
    graph.add(gtsam.JacobianFactor(1, np.eye(1), np.zeros(1), gtsam.noiseModel.Unit.Create(1)))
    try:
        return graph.eliminateSequential().optimize().at(0)
    except RuntimeError as err:
        assert "ndetermina" in str(err)
        return None


def known(bits):
    return np.array([[1.0, -1.0], [0.0, 2.0**-bits]])


refused, taken = known(12), known(11)
plain = np.linalg.solve(refused.T @ refused, refused.T @ refused @ np.ones(2))
print("2^-12:", solved(refused), " numpy:", plain, " 2^-11:", solved(taken), " other units:", solved(refused * [1.0, 1e3]))
assert solved(refused) is None and solved(refused * [1.0, 1e3]) is None
assert np.allclose(plain, 1.0, atol=1e-7)
assert np.allclose(solved(taken), 1.0, atol=1e-7)
assert solved(np.diag([1.0, 2.0**-20])) is not None
PYTHON
