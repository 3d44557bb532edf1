"""Goldfarb and Idnani's dual active-set method (1983) for a small dense QP, compiled.

min 1/2 x^T P x + c^T x over x = (v, s), subject to lower <= x <= upper and, a row, g v - s <= h.

Everything is done in y = L^T x with P = L L^T, where the cost is the distance from the unbounded
minimiser. The constraint that is violated most joins the active ones, which let go of those whose
multiplier would turn negative, until none is violated.

DAQP, of the same family, takes longer to get at such a problem than to solve it: it copies, checks
and scales all rows, and few ever become active. Here rows are read where they are, once a step.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from horf_env.types import FloatArray, IntArray

# Least violation that counts, in units of the constraint; steps leave errors of some 1e-14.
_VIOLATED = 1e-10
# A normal of which less than this share (squared) stands out of the active ones depends on them.
_DEPENDENT = 1e-20
_MOST_STEPS = 100  # none of 60,000 problems of episodes took more than 26


class _Active(NamedTuple):
    """Active constraints, k of them, in memory for n; changed in place.

    Attributes:
        Q: The first k rows are orthonormal and span the normals, shape (n, n).
        R: Triangle (k, k) whose columns are the normals in terms of these rows, shape (n, n).
        multipliers: Shape (n,).
        out: Part of a new normal that stands out of the span, shape (n,).
        along: Its parts along the rows of Q, shape (n,).
        slopes: What each multiplier loses for each unit of the new one, shape (n,).
    """

    Q: FloatArray
    R: FloatArray
    multipliers: FloatArray
    out: FloatArray
    along: FloatArray
    slopes: FloatArray


@numba.njit(cache=True, error_model="numpy")
def minimiser(
    P: FloatArray, c: FloatArray, lower: FloatArray, upper: FloatArray, rows: FloatArray
) -> tuple[FloatArray, int, bool]:
    """Solve the QP, without any memory of the one before.

    Args:
        P: Positive definite, shape (n, n).
        c: Shape (n,).
        lower: Lower bounds, shape (n,).
        upper: Upper bounds, shape (n,).
        rows: (g, h) a row, shape (m, n).

    Returns:
        x, shape (n,); the number of steps; and whether x is the minimiser. It is not if no x keeps
        all constraints, or if the steps do not come to an end.
    """
    n = len(c)
    L, y, x, normal = _cholesky(P), -c, np.empty(n), np.empty(n)
    memory = np.empty((4, n))
    active = _Active(np.empty((n, n)), np.empty((n, n)), memory[0], memory[1], memory[2], memory[3])
    count, reached = 0, _reached(lower, upper, rows)
    _forward(L, y)
    for steps in range(_MOST_STEPS):
        _backward(L, y, x)
        worst, violation = _most_violated(x, lower, upper, rows, reached)
        if violation <= _VIOLATED:
            return x, steps, True
        _set_normal(normal, worst, rows)
        _forward(L, normal)
        count = _activate(normal, violation, y, active, count)
        if count < 0:
            return x, steps, False
    return x, _MOST_STEPS, False


@numba.njit(cache=True, error_model="numpy")
def _cholesky(P: FloatArray) -> FloatArray:
    """Lower triangle L with P = L L^T."""
    n = len(P)
    L = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            rest = P[i, j]
            for k in range(j):
                rest -= L[i, k] * L[j, k]
            L[i, j] = np.sqrt(rest) if i == j else rest / L[j, j]
    return L


@numba.njit(cache=True, error_model="numpy")
def _forward(L: FloatArray, b: FloatArray) -> None:
    """Replace b by y of L y = b."""
    for i in range(len(b)):
        for j in range(i):
            b[i] -= L[i, j] * b[j]
        b[i] /= L[i, i]


@numba.njit(cache=True, error_model="numpy")
def _backward(L: FloatArray, y: FloatArray, x: FloatArray) -> None:
    """Set x to that of L^T x = y."""
    n = len(x)
    for i in range(n - 1, -1, -1):
        x[i] = y[i]
        for j in range(i + 1, n):
            x[i] -= L[j, i] * x[j]
        x[i] /= L[i, i]


@numba.njit(cache=True, error_model="numpy")
def _reached(lower: FloatArray, upper: FloatArray, rows: FloatArray) -> IntArray:
    """Rows that some x within the bounds does not keep; the others need not be looked at."""
    n, count = len(lower), 0
    reached = np.empty(len(rows), dtype=np.int64)
    for k in range(len(rows)):
        most = -lower[n - 1]
        for i in range(n - 1):
            most += max(rows[k, i] * lower[i], rows[k, i] * upper[i])
        if not most <= rows[k, n - 1]:  # nor if it is 0 times infinity
            reached[count] = k
            count += 1
    return reached[:count]


@numba.njit(cache=True, error_model="numpy")
def _most_violated(
    x: FloatArray, lower: FloatArray, upper: FloatArray, rows: FloatArray, reached: IntArray
) -> tuple[int, float]:
    """Number of the constraint (see `_set_normal`) that is violated most, and by how much."""
    n = len(x)
    worst, most = 2 * n - 1, lower[n - 1] - x[n - 1]
    if most > _VIOLATED:  # below its bound, s makes rows look violated that are not
        return worst, most
    for i in range(n):
        above, below = x[i] - upper[i], lower[i] - x[i]
        if above > most:
            worst, most = i, above
        if below > most:
            worst, most = n + i, below
    for k in reached:
        violation = -x[n - 1] - rows[k, n - 1]
        for i in range(n - 1):
            violation += rows[k, i] * x[i]
        if violation > most:
            worst, most = 2 * n + k, violation
    return worst, most


@numba.njit(cache=True, error_model="numpy")
def _set_normal(normal: FloatArray, constraint: int, rows: FloatArray) -> None:
    """Outward normal: first those of the upper bounds, then of the lower ones, then of the rows."""
    n = len(normal)
    row = constraint - 2 * n
    for i in range(n):
        normal[i] = rows[row, i] if row >= 0 else 0.0
    if row >= 0:
        normal[n - 1] = -1.0
    else:
        normal[constraint % n] = 1.0 if constraint < n else -1.0


@numba.njit(cache=True, error_model="numpy")
def _activate(
    normal: FloatArray, violation: float, y: FloatArray, active: _Active, count: int
) -> int:
    """Move y until a constraint is no longer violated, held there by it and active ones.

    Returns:
        How many are active now; -1 if the constraint contradicts them.
    """
    multiplier, length = 0.0, _dot(normal, normal)
    while True:
        _split(normal, active, count)
        blocking, dual_step = _first_to_let_go(active, count)
        rest = _dot(active.out, active.out)
        step = violation / rest if rest > _DEPENDENT * length else np.inf
        taken = min(step, dual_step)
        if not taken < np.inf:  # nor if it is not a number
            return -1
        multiplier += taken
        for i in range(count):
            active.multipliers[i] -= taken * active.slopes[i]
        if step < np.inf:
            violation -= taken * rest
            for i in range(len(y)):
                y[i] -= taken * active.out[i]
        if step <= dual_step:
            _append(active, multiplier, np.sqrt(rest), count)
            return count + 1
        _remove(blocking, active, count)
        count -= 1


@numba.njit(cache=True, error_model="numpy")
def _dot(a: FloatArray, b: FloatArray) -> float:
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@numba.njit(cache=True, error_model="numpy")
def _split(normal: FloatArray, active: _Active, count: int) -> None:
    """Set `out`, `along` and `slopes` = R^-1 along of a normal."""
    Q, R, _, out, along, slopes = active
    for i in range(len(normal)):
        out[i], along[i] = normal[i], 0.0
    for _ in range(2):  # once more: what rounding left along them
        for k in range(count):
            part = _dot(Q[k], out)
            along[k] += part
            for i in range(len(out)):
                out[i] -= part * Q[k, i]
    for i in range(count - 1, -1, -1):
        slopes[i] = along[i]
        for j in range(i + 1, count):
            slopes[i] -= R[i, j] * slopes[j]
        slopes[i] /= R[i, i]


@numba.njit(cache=True, error_model="numpy")
def _first_to_let_go(active: _Active, count: int) -> tuple[int, float]:
    """Place of the multiplier that is the first to reach 0, and after which step."""
    first, step = -1, np.inf
    for i in range(count):
        slope = active.slopes[i]
        if slope > 0.0 and active.multipliers[i] < step * slope:
            first, step = i, active.multipliers[i] / slope
    return first, step


@numba.njit(cache=True, error_model="numpy")
def _append(active: _Active, multiplier: float, length: float, count: int) -> None:
    """Put the normal that was split behind the others; `length` is that of `out`."""
    active.multipliers[count] = multiplier
    for i in range(count):
        active.R[i, count] = active.along[i]
    active.R[count, count] = length
    for i in range(len(active.out)):
        active.Q[count, i] = active.out[i] / length


@numba.njit(cache=True, error_model="numpy")
def _remove(place: int, active: _Active, count: int) -> None:
    """Take a constraint out; rotations of Q's rows make R a triangle again."""
    Q, R, multipliers = active.Q, active.R, active.multipliers
    for k in range(place, count - 1):
        multipliers[k] = multipliers[k + 1]
        for i in range(k + 2):
            R[i, k] = R[i, k + 1]
        length = np.sqrt(R[k, k] ** 2 + R[k + 1, k] ** 2)
        c, s = R[k, k] / length, R[k + 1, k] / length
        _rotate(R, k, c, s, k, count)
        _rotate(Q, k, c, s, 0, len(Q))


@numba.njit(cache=True, error_model="numpy")
def _rotate(A: FloatArray, k: int, c: float, s: float, begin: int, end: int) -> None:
    """Rotate rows k and k + 1 within some columns."""
    for j in range(begin, end):
        A[k, j], A[k + 1, j] = c * A[k, j] + s * A[k + 1, j], c * A[k + 1, j] - s * A[k, j]
