"""Methods of scipy.optimize over a problem whose trials may fail: then the step is shortened, from the best so far."""

import math
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.equal import NOMINAL_RTOL
from mbd.optimization.problem import Evaluated, FailedTrial, Problem, TrialsSpent

METHODS = ("SLSQP", "trust-constr", "least_squares")
MAX_BOXES = 60
"""Most boxes."""


def searched(problem: Problem, method: str, accuracy: float) -> tuple[bool, str]:
    """Search from the best trial; whether it converged, and why it ended.

    A trial that fails, such as a walk that falls, ends the round. The next one begins at the best trial and looks no
    further than half the way to the one that failed; a round that ends at the edge of its box makes it larger again.
    """
    assert problem.best is not None
    radius, may_grow, outcome = np.inf, True, ""
    for _ in range(MAX_BOXES):
        best = problem.best
        try:
            converged, message, u = _round(problem, method, accuracy, radius)
        except FailedTrial as failure:
            outcome = failure.outcome
            radius, may_grow = 0.5 * float(np.max(np.abs(failure.u - problem.best.u))), False
            if radius < accuracy:
                return False, f"trials beside the best one fail: {outcome}"
            continue
        except TrialsSpent:
            return False, f"{problem.most} trials were made, the most allowed"
        inside = np.max(np.abs(u - best.u)) < radius * (1.0 - NOMINAL_RTOL)
        if inside or np.isinf(radius):
            return converged, message
        if not problem.better(problem.best, best):
            return False, f"no better trial is found beside those that fail: {outcome}"
        radius, may_grow = (2.0 * radius if may_grow else radius), True
    return False, f"{MAX_BOXES} rounds were made; the last trial that failed: {outcome}"


def _round(problem: Problem, method: str, accuracy: float, radius: float) -> tuple[bool, str, Vector]:
    """One search within a box around the best trial: whether it converged, why it ended, where."""
    assert problem.best is not None
    begin = problem.best.u
    low, high = problem.bounds
    low, high = np.maximum(low, begin - radius), np.minimum(high, begin + radius)
    if method == "least_squares":
        return _squares(problem, (low, high), accuracy)
    import scipy.optimize

    minimize: Any = scipy.optimize.minimize
    constraints = _constraints(problem, method)
    options: dict[str, Any] = {"ftol": accuracy**1.25, "maxiter": problem.most}
    if method == "trust-constr":
        options = {"xtol": accuracy, "gtol": accuracy**1.5, "barrier_tol": accuracy**1.5, "maxiter": problem.most}
        options["initial_tr_radius"] = 0.1
    found = minimize(
        lambda u: problem.objective(problem.at(u)) / problem.size, begin, method=method,
        jac=lambda u: problem.gradient(problem.at(u)) / problem.size, constraints=constraints,
        bounds=scipy.optimize.Bounds(low, high, keep_feasible=True), options=options,
    )  # fmt: skip
    return found.status in ((0,) if method == "SLSQP" else (1, 2)), str(found.message), np.asarray(found.x)


def _constraints(problem: Problem, method: str) -> Any:
    """Those of the problem, over their scales, as a method takes them."""
    scale = problem.limit_scale
    if not problem.limits:
        return ()
    low = np.array([limit.low for limit in problem.limits]) / scale
    high = np.array([limit.high for limit in problem.limits]) / scale

    def value(u: Vector) -> Vector:
        return np.asarray(problem.at(u).limits / scale)

    def slope(u: Vector) -> Any:
        return problem.slopes(problem.at(u))[1] / scale[:, None]

    if method == "trust-constr":
        from scipy.optimize import NonlinearConstraint

        return [NonlinearConstraint(value, low, high, jac=slope)]
    same, below, above = low == high, np.isfinite(high), np.isfinite(low)
    kinds = (("eq", 1.0, same, low), ("ineq", -1.0, below & ~same, high), ("ineq", 1.0, above & ~same, low))

    def one(kind: str, sign: float, rows: Any, end: Vector) -> dict[str, Any]:
        def over(u: Vector) -> Vector:
            return np.asarray(sign * (value(u)[rows] - end[rows]))

        return {"type": kind, "fun": over, "jac": lambda u: sign * slope(u)[rows]}

    return [one(kind, sign, rows, end) for kind, sign, rows, end in kinds if np.any(rows)]


def _squares(problem: Problem, box: tuple[Vector, Vector], accuracy: float) -> tuple[bool, str, Vector]:
    """The least sum of squares; a trial that fails is infinite to it, so that it shortens its step itself."""
    from scipy.optimize import least_squares

    assert problem.best is not None
    size = math.sqrt(problem.size)

    def residuals(u: Vector) -> Vector:
        try:
            return problem.at(u).parts / size
        except FailedTrial:
            return np.full(len(problem.parts), np.inf)

    def slopes(u: Vector) -> Any:
        return problem.slopes(_known(problem, u))[0] / size

    found = least_squares(
        residuals, problem.best.u, slopes, box, xtol=accuracy,
        ftol=accuracy**1.5, gtol=1e-14, max_nfev=problem.most,
    )  # fmt: skip
    return found.status > 0, str(found.message), np.asarray(found.x)


def _known(problem: Problem, u: Vector) -> Evaluated:
    """The best trial, if it is there: its derivatives need no run."""
    best = problem.best
    return best if best is not None and np.array_equal(best.u, u) else problem.at(u)
