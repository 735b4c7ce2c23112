# SPDX-License-Identifier: BSD-3-Clause
"""What rests say of friction, with sigmas that hold: the likelihood of a band falls off a cliff on one side only.

The largest of n torques lies some s / n below the edge s of the band. The most likely s is there, too small, and no
Gaussian at it says how much wider the band may be. So mean and covariance are those of the posterior itself. Each
motor's bands tell of a few combinations z of the values; over these it is sampled,

    p(z) = (1 + G z)^n exp(-|z|^2 / 2 - c' z - sum of the bands' costs at  y + Y z,  half + H z),

z ~ N(0, 1) without the bands, (1 + G z)^n as the n commands were recorded and not the torques (linear_rests.py). The
two moments of z stand in the joint Gaussian in place of the bands. What is not known of the likelihood is sampled
along: which share of the motors slid to where they rest, how near to the edge they stayed, how much of what friction
can hold swings of the links took off, and how well edges repeat.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.friction_band import band_cost, piled_cost
from jointscope.graphs.rest_sets.rest_set import EDGE, RestSet
from jointscope.graphs.rests.linear_rests import LinearRests
from jointscope.graphs.rests.rests_by_values import RestsByValues, SaidElsewhere
from jointscope.graphs.rests.taken_for_granted import unsure
from jointscope.graphs.rests.walkers import moments
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
TOLD = 0.25  # information, over that without bands, of a combination of which a motor's bands tell something
WALKERS, SEED = 64, 1
MOST_ODDS = 10.0  # logit of a share in piles that is all
FEW, NONE = -4.0, -14.0  # logits from where to where the share is none
BELIEF = 10.0  # how much likelier piles must make rests to be believed as much as none
DEPTHS = np.log((0.01, 0.5))  # of the piles below the edges, of the band; deeper ones are spread over it
BLURS = np.log((0.1 * EDGE, EDGE))  # of the edges, of the friction
MOST_OF_BAND = 0.5  # that a swing can have taken off
MOST_SHRINKS = 100  # of where walkers begin, towards the likeliest values
SMALLEST_SHARE = 0.1  # of a positive value that its mean leaves of it
SMALLEST_INFORMATION = 1e-3  # of all together, over that without bands


def band_posterior(
    problem: RestSet, robot: Robot, x: Array, calibration: Calibration, elsewhere: SaidElsewhere | None = None
) -> tuple[Calibration, Array]:
    """Mean and covariance of the values, friction bands integrated over.

    Args:
        problem: all rests with their weights.
        robot: with the priors.
        x: states of largest likelihood, shape (m, d).
        calibration: values there.
        elsewhere: what other recordings say, in place of priors.

    Returns:
        Means as calibration, covariance of its coordinates, shape (p, p).

    Raises:
        SolveError: a band that closes at a rest.
    """
    known, count = calibration, len(calibration.names)
    by_values = RestsByValues.of(problem, unsure(robot, problem.rests), x, calibration, elsewhere)
    values, size = by_values.calibration.values, by_values.size
    linear = _of_each(by_values.linear, count)
    least = np.where(by_values.straight, -values, -np.inf)[:count]
    d = np.zeros(len(linear.b))
    if len(d) > count:  # walkers begin where the rests are likeliest, whatever masses and loads are
        d = linear.minimum(np.arange(len(d)))[0]
        d *= min(1.0, (1.0 - SMALLEST_SHARE) / max(float(np.max(d[:count] / least)), 1e-300))  # above zero
    linear = linear.moved(d)
    least = np.append(least, np.full(len(d) - count, -np.inf)) - d
    change, covariance = _moments(linear, least)
    change, covariance = (change + d)[:count], covariance[:count, :count]
    values, size, straight = values[:count], size[:count], by_values.straight[:count]
    moved = np.log(np.where(straight, np.maximum(values + change, SMALLEST_SHARE * values), 1.0))
    found = known.with_points({DYNAMICS: np.where(straight, moved, known.dynamics + change / size)})
    scale = np.where(straight, found.value_by_coordinate, size)
    return found, covariance / np.outer(scale, scale)


def _of_each(linear: LinearRests, count: int) -> LinearRests:
    """Masses and loads behind the first `count` values as values that each motor has for itself.

    Moments of a motor's bands are joined as Gaussians, and what two bands share near their sharp edges is none.

    Args:
        linear: the rests.
        count: of the values that are asked.
    """
    motors = np.unique(linear.motor).tolist()
    own = [
        np.where((linear.motor == j)[:, None], part[:, count:], 0.0) for part in (linear.Y, linear.H) for j in motors
    ]
    Y, H = (
        np.hstack([part[:, :count], *own[k * len(motors) : (k + 1) * len(motors)]])
        for k, part in enumerate((linear.Y, linear.H))
    )
    A = np.zeros((Y.shape[1], Y.shape[1]))
    A[:count, :count] = linear.A[:count, :count]
    np.fill_diagonal(A[count:, count:], np.tile(np.diag(linear.A)[count:], len(motors)))
    b = np.append(linear.b[:count], np.zeros(len(A) - count))
    told = np.any(Y != 0.0, axis=0) | np.any(H != 0.0, axis=0) | (np.arange(len(A)) < count)
    G = np.hstack([linear.G[:, :count], np.zeros((len(linear.G), len(A) - count))])
    return replace(linear, A=A, b=b, Y=Y, H=H, G=G).of_columns(np.flatnonzero(told))


def _moments(linear: LinearRests, least: Array) -> tuple[Array, Array]:
    """Mean and covariance of the change of the values, which may fall to `least`, shape (p,)."""
    unit = 1.0 / np.sqrt(np.diag(linear.A))
    try:
        L = unit[:, None] * np.linalg.inv(np.linalg.cholesky(linear.A * np.outer(unit, unit))).T  # L L' = A^-1
    except np.linalg.LinAlgError as err:
        raise SolveError(
            "the values of these rests have no covariance where they are likeliest: the model contradicts the rests by "
            "far; loads, units, signs or names may be wrong: look at what `jointscope compare ROBOT --rests BAG` says"
        ) from err
    motors = [MotorBands.of(linear, j, L, least) for j in np.unique(linear.motor).tolist()]
    c = L.T @ linear.b
    P, h = np.eye(len(c)), -c
    for motor in motors:
        V = motor.V
        h -= motor.slope - V @ (V.T @ motor.slope)
        if V.shape[1]:
            slope = V.T @ c  # edges of other motors pull as far as they are blurred, and no further
            mean, covariance = motor.moments(slope)
            inverse = np.linalg.inv(covariance)
            P += V @ (inverse - np.eye(len(mean))) @ V.T
            h += V @ (inverse @ mean + slope)
    information, vectors = np.linalg.eigh(P)
    covariance = (vectors / np.maximum(information, SMALLEST_INFORMATION)) @ vectors.T
    return L @ covariance @ h, L @ covariance @ L.T


@dataclass(frozen=True)
class MotorBands:
    """Bands of one motor at m rests, over r combinations z of the values.

    Attributes:
        y, half, noise, scale, before: shape (m,) [N m].
        Y, H: slopes, shape (m, r).
        V: the combinations that they tell of, among whitened changes of the values, shape (p, r).
        slope: of the cost by these changes, shape (p,).
        G: slopes of the logarithm of the motor's gain, shape (r,).
        T, least: change of the values that may not fall further than so by z, shape (b, r) and (b,).
        start: covariance of where to look for z, shape (r, r).
    """

    y: Array
    half: Array
    noise: Array
    scale: Array
    before: Array
    Y: Array
    H: Array
    V: Array
    slope: Array
    G: Array
    T: Array
    least: Array
    start: Array

    @staticmethod
    def of(linear: LinearRests, j: int, L: Array, least: Array) -> MotorBands:
        """Of motor j, over changes L z of the values, which may fall to `least`, shape (p,)."""
        own, bounded = linear.motor == j, np.isfinite(least)
        y, half, noise = linear.y[own], linear.half[own], linear.sigma[own]
        scale, before = linear.scale[own], linear.before[own]
        Y, H, G = linear.Y[own] @ L, linear.H[own] @ L, linear.G[j] @ L
        found = band_cost(y, half, np.hypot(EDGE * scale, noise))
        told, vectors = np.linalg.eigh(
            Y.T @ (found.torque_information[:, None] * Y)
            + H.T @ (found.half_information[:, None] * H)
            + len(half) * np.outer(G, G)
        )
        V = vectors[:, told > TOLD]
        slope, Y, H, G = Y.T @ found.by_torque + H.T @ found.by_half - len(half) * G, Y @ V, H @ V, G @ V
        # edges of n rests lie some share r / n of the band beyond the outermost: walkers begin as far apart
        wide = half * V.shape[1] / len(half)
        yy, yh, hh = (part[:, None] for part in band_cost(y, half, np.hypot(wide, noise)).curvature)
        curved = Y.T @ (yy * Y + yh * H) + H.T @ (yh * Y + hh * H) + len(half) * np.outer(G, G)
        start = np.linalg.inv(np.eye(V.shape[1]) + curved)
        return MotorBands(y, half, noise, scale, before, Y, H, V, slope, G, L[bounded] @ V, least[bounded], start)

    def cost(self, z: Array, odds: Array, depth: Array, blur: Array, taken: Array, slope: Array) -> Array:
        """Of k points, shape (k,).

        Args:
            z: shape (k, r).
            odds: logit of the share in piles, shape (k,).
            depth: logarithm of the depth of the piles, of the band, shape (k,).
            blur: logarithm of that of the edges, of the friction, shape (k,).
            taken: share of what swings may have taken off, that they took, shape (k,).
            slope: of the cost without these bands, shape (r,).
        """
        half, gain, found = self.half + z @ self.H.T, 1.0 + z @ self.G, np.full(len(z), np.inf)
        half = half - np.minimum(taken[:, None] * self.before, MOST_OF_BAND * half)
        inside = np.all(half > 0.0, axis=1) & (gain > 0.0) & np.all(z @ self.T.T > self.least, axis=1)
        inside &= (odds < MOST_ODDS) & (odds > NONE)
        for value, (low, high) in ((depth, DEPTHS), (blur, BLURS), (taken, (0.0, 1.0))):
            inside &= (value > low) & (value < high)
        if inside.any():
            z, share = z[inside], expit(odds[inside])
            sigma = np.hypot(np.exp(blur[inside])[:, None] * self.scale, self.noise)
            bands = piled_cost(self.y + z @ self.Y.T, half[inside], sigma, share, np.exp(depth[inside]))
            costs = bands + np.log(sigma)  # of densities, whose blur is not the same
            costs -= np.log(gain[inside])[:, None]
            jeffreys = -0.5 * np.log(share * (1.0 - share))  # his prior of a share, on the axis of its logit
            jeffreys = np.where(odds[inside] < FEW, -np.log(BELIEF * np.pi / (FEW - NONE)), jeffreys)
            found[inside] = jeffreys + costs.sum(axis=1) + 0.5 * np.sum(z**2, axis=1) + z @ slope
        return found

    def moments(self, slope: Array) -> tuple[Array, Array]:
        """Mean and covariance of z; `slope` as of `cost`."""
        rng, r = np.random.default_rng(SEED), len(slope)
        z = rng.normal(size=(WALKERS, r)) @ np.linalg.cholesky(self.start).T
        low, high = (NONE, DEPTHS[0], BLURS[0], 0.0), (2.0, DEPTHS[1], BLURS[1], 1.0)
        rest = rng.uniform(low, high, (WALKERS, len(low)))

        def cost(point: Array) -> Array:
            odds, depth, blur, taken = point[:, r:].T
            return self.cost(point[:, :r], odds, depth, blur, taken, slope)

        for _ in range(MOST_SHRINKS):
            lost = ~np.isfinite(cost(np.hstack([z, rest])))
            if not np.any(lost):
                break
            z[lost] *= 0.7
        else:
            raise SolveError(
                f"a friction band closes at one of its {len(self.y)} rests: with the likeliest values friction there "
                "is zero or less; leave out terms of it that these loads do not tell (`fixed: true` with value 0), or "
                "record more loads"
            )
        mean, covariance = moments(cost, np.hstack([z, rest]), rng)
        return mean[:r], covariance[:r, :r]
