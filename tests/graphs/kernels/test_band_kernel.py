# SPDX-License-Identifier: BSD-3-Clause
"""The compiled elimination against LAPACK's band, which needs several passes."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.linalg import lapack

from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.inner_states import InnerStates
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.robots.errors import SolveError

SIZES = [(12, 25), (18, 31), (4, 12), (1, 3), (2, 0), (6, 1)]


def _random_chain(d: int, p: int, m: int = 40, seed: int = 3) -> NormalEquations:
    """Normal equations of random residuals: each sees two neighbours and the shared values."""
    rng = np.random.default_rng(seed)
    system = NormalEquations.zeros(m, d, p)
    for k in range(m - 1):
        J = rng.normal(size=(2 * d + 2, 2 * d + p))
        H = J.T @ J
        system.D[k] += H[:d, :d]
        system.D[k + 1] += H[d : 2 * d, d : 2 * d]
        system.E[k] += H[d : 2 * d, :d]
        system.B[k] += H[:d, 2 * d :]
        system.B[k + 1] += H[d : 2 * d, 2 * d :]
        system.C += H[2 * d :, 2 * d :]
    system.g_x[:], system.g_p[:] = rng.normal(size=(m, d)), rng.normal(size=p)
    return system


def _by_lapack(system: NormalEquations, damping: np.ndarray):
    """Band of L, W and w, S and s."""
    m, d, p = system.B.shape
    columns = np.zeros((m, d, 2 * d))
    for b in range(d):
        columns[:, b, : d - b] = system.D[:, b:, b]
        columns[:-1, b, d - b : 2 * d - b] = system.E[:, :, b]
    columns[:, :, 0] *= 1.0 + damping[:, None]
    L, info = lapack.dpbtrf(columns.reshape(m * d, 2 * d).T, lower=1)
    assert info == 0
    right = np.column_stack([system.B.reshape(m * d, p), system.g_x.ravel()])
    W, info = lapack.dtbtrs(L, right, uplo="L")
    assert info == 0
    square = W.T @ W
    return L, W, system.C - square[:p, :p], system.g_p - square[:p, p]


@pytest.mark.parametrize(("d", "p"), SIZES)
@pytest.mark.parametrize("damped", [False, True])
def test_the_kernel_equals_lapack(d, p, damped):
    system = _random_chain(d, p)
    damping = np.random.default_rng(5).uniform(0.0, 0.5, len(system.D)) * damped
    L, W, S, s = _by_lapack(system, damping)
    found = eliminate(system, damping)
    for got, wanted in ((found.L, L), (np.column_stack([found.W, found.w]), W)):
        np.testing.assert_allclose(got, wanted, rtol=1e-12, atol=1e-12 * np.abs(wanted).max())
    for got, wanted, before in ((found.S, S, system.C), (found.s, s, system.g_p)):
        np.testing.assert_allclose(got, wanted, rtol=1e-12, atol=1e-12 * np.abs(before).max(initial=0.0))


def test_the_same_system_gives_the_same_bits():
    system = _random_chain(12, 25)
    first, second = eliminate(system), eliminate(system)
    assert np.array_equal(first.L, second.L) and np.array_equal(first.S, second.S)


@pytest.mark.parametrize("d", [1, 12, 18])
def test_a_pivot_that_is_not_positive_is_named_with_its_tick_and_component(d):
    system = _random_chain(d, 3)
    system.D[7, d - 1, d - 1] = -1.0
    with pytest.raises(SolveError, match=rf"the state at tick 17 \(component {d - 1} of {d}\) is not determined"):
        eliminate(system, first_tick=10)


def test_a_chain_of_one_state_has_no_blocks_below():
    system = _random_chain(3, 2, m=2)
    single = NormalEquations(
        system.D[:1] + np.eye(3), system.E[:0], system.B[:1], system.C, system.g_x[:1], system.g_p, 0.0, np.zeros(1)
    )
    wanted = single.C - single.B[0].T @ np.linalg.solve(single.D[0], single.B[0])
    np.testing.assert_allclose(eliminate(single).S, wanted, rtol=1e-10)


def test_numba_is_imported_only_where_something_is_solved():
    code = "import sys, jointscope.graphs.solving.batch_solver; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], env=os.environ).returncode == 0


@pytest.mark.parametrize(("d", "p", "m"), [(12, 24, 9), (3, 5, 4), (1, 2, 3), (2, 0, 2)])
def test_a_chain_without_its_inner_states_equals_the_dense_schur_complement(d, p, m):
    system = _random_chain(d, p, m)
    kept, damping = np.arange(p)[::2], np.random.default_rng(6).uniform(0.0, 0.5, m)
    inner, blocks = slice(d, (m - 1) * d), m * d + kept
    rim = np.concatenate([np.arange(d), np.arange((m - 1) * d, m * d), blocks])
    H, g = np.zeros((m * d + p, m * d + p)), np.concatenate([system.g_x.ravel(), system.g_p])
    for k in range(m):
        own = slice(k * d, (k + 1) * d)
        H[own, own] = system.D[k] + damping[k] * np.diag(np.diag(system.D[k]))
        H[own, m * d :] = system.B[k]
        H[m * d :, own] = system.B[k].T
        if k < m - 1:
            H[(k + 1) * d : (k + 2) * d, own], H[own, (k + 1) * d : (k + 2) * d] = system.E[k], system.E[k].T
    H[m * d :, m * d :] = system.C
    A, B = H[inner, inner], H[inner][:, rim]
    found = InnerStates.of(system, kept, damping, 0)
    np.testing.assert_allclose(found.H, H[np.ix_(rim, rim)] - B.T @ np.linalg.solve(A, B), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.g, g[rim] - B.T @ np.linalg.solve(A, g[inner]), rtol=1e-9, atol=1e-9)
    assert found.gain == pytest.approx(0.5 * float(g[inner] @ np.linalg.solve(A, g[inner])), rel=1e-9)
    step = np.random.default_rng(7).normal(size=len(rim))
    change = np.zeros(p)
    change[kept] = step[2 * d :]
    moved = found.states(step[:d], step[d : 2 * d], change)
    np.testing.assert_allclose(moved.ravel(), -np.linalg.solve(A, g[inner] + B @ step), rtol=1e-8, atol=1e-10)
