"""`mbd.optimize`: the unknowns that make a run or a gait best."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mbd.analysis.fitting.fit import bounds
from mbd.arrays import Vector
from mbd.bodies.values import among, is_number, shown
from mbd.equal import HALF_PRECISION_RTOL, NOMINAL_RTOL
from mbd.errors import ModelError
from mbd.gait.cycle import LimitCycle
from mbd.integrators import Integrator
from mbd.lagrangian import Lagrangian
from mbd.model import Model
from mbd.optimization.formula import formula
from mbd.optimization.optimum import Active, Optimum
from mbd.optimization.points import FunctionSource, GaitSource, Source
from mbd.optimization.problem import Evaluated, Limit, Problem
from mbd.optimization.runs import Functions, RunSource
from mbd.optimization.search import METHODS, searched
from mbd.progress import trial_bar
from mbd.state import State


def optimize(
    problem: Model | Lagrangian | LimitCycle | Callable[[dict[str, float]], Any],
    parameters: Mapping[str, Any],
    start: State | None = None,
    integrator: Integrator | None = None,
    dt: float | None = None,
    tol: float | None = None,
    *,
    until: float | str | tuple[str, float] | None = None,
    minimize: Any = None,
    maximize: Any = None,
    constraints: Mapping[str, Any] | None = None,
    functions: Functions | None = None,
    method: str | None = None,
    accuracy: float = 1e-8,
    most: int = 200,
    progress: bool = True,
    backend: str = "auto",
) -> Optimum:
    """Find the parameters with which a gait or a run is best, within bounds and under constraints.

    Makes f(x) smallest (or largest) subject to low ≤ c(x) ≤ high and x between its bounds, with the exact derivatives
    of gaits (`LimitCycle.derivatives`) and of runs (`mbd.sensitivities`), by the methods of `scipy.optimize`. The
    unknowns, the objective and the constraints are scaled. A trial that fails, such as a walk that falls, is kept with
    its outcome; the search goes on from the best trial so far with at most half of that step. Ctrl-C ends the search
    with the best trial so far.

    Parameters
    ----------
    problem : a gait of `mbd.limit_cycle`, whose numbers are `LimitCycle.scalars` and 'cost of transport'; a model, of
        whose runs they are results at the end and instants of events, as for `mbd.sensitivities`; or a function of a
        dictionary of the unknowns that gives a `LimitCycle`, a `Sensitivities` with the unknowns as columns, or a
        dictionary of numbers, which alone are differentiated by differences
    parameters : the unknowns by name: a guess, ``{"hip.mass": 8.0}``, or (guess, lowest, highest). Of a model also
        coordinates and rates of the start
    start, integrator, dt, tol, until : of the runs of a model, see `mbd.simulate`
    minimize, maximize : one of them: the name of a number, or a function of numbers by name,
        ``lambda n: (n["step length of left foot"] - n["step length of right foot"]) ** 2``, unknowns among them. A list
        of several to minimize stands for the sum of their squares
    constraints : limits by the name of a number, ``{"largest multiplier": (None, 0.8), "speed": 0.7}``, or by any title
        with a function of numbers first, ``{"same steps": (lambda n: n["a"] - n["b"], 0.0, 0.0)}``
    functions : ``{"slope": lambda s: {"gravity.x": 9.81 * mbd.sin(s), …}}``: functions of an unknown that give
        parameters of a model; a gait has its own
    method : 'SLSQP' (Kraft, DFVLR-FB 88-28, 1988), 'trust-constr' (Byrd, Hribar & Nocedal, SIAM J. Optim. 9, 1999), or
        'least_squares' (Branch, Coleman & Li 1999) for lists without constraints; None chooses the last where it can
        be and else the first
    accuracy : of the unknowns, over their scales: the distance of their bounds, else the size of the guess [-]
    most : trials at most
    progress : whether a bar on a terminal counts trials
    backend : see `mbd.simulate`

    Returns
    -------
    Optimum

    Raises
    ------
    ModelError, UnknownNameError
        for arguments that cannot be meant.
    GaitError, SimulationError, CapabilityError
        where the guess itself has no numbers or derivatives.

    Examples
    --------
    The pendulum of a given length in front of whose pin the period is shortest: r = √(I/m), here 0.5 m.

    >>> import mbd
    >>> model = mbd.Model("pendulum")
    >>> rod = mbd.Link("rod", mass=2.0, length=1.0, center=0.8, inertia=0.5)
    >>> model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    >>> model.constrain(mbd.Event("below", mbd.measure(lambda a: a, "pin.angle"), terminal=True))
    >>> start = mbd.assemble(model, {"pin.angle": 0.01})
    >>> found = mbd.optimize(model, {"rod.center": (0.8, 0.1, 1.0)}, start, mbd.RungeKutta853(), 0.01, until="below",
    ...                      minimize="time")
    >>> print(f"{found['rod.center']:.5f}")
    0.50000
    """
    guess, low, high = bounds(parameters)
    names, functions = tuple(parameters), {} if functions is None else functions
    parts, limits, squares, sign, what = _wanted(minimize, maximize, constraints)
    method = _method(method, squares, bool(limits))
    _check_numbers(accuracy, most, progress)
    settings = (start, integrator, dt, tol, until)
    source = _source(problem, names, guess, settings, functions, backend)

    def check(name: str) -> None:
        if name not in names:
            source.check(name)

    converged: bool | None
    with trial_bar(progress, what) as report:
        task = Problem(
            source, names, guess, low, high, [formula(each, what, check) for each in parts],
            [Limit(title, formula(each, f"constraint {title!r}", check), a, b) for title, each, a, b in limits],
            squares, sign, most, report,
        )  # fmt: skip
        try:
            task.begin()
            converged, message = searched(task, method, accuracy)
        except KeyboardInterrupt:
            if task.best is None:
                raise
            converged, message = None, "interrupted; this is the best trial so far"
    return _concluded(task, converged, message, method, what)


# arguments ----------------------------------------------------------------------------------------------------------
def _wanted(minimize: Any, maximize: Any, constraints: Any) -> tuple[list[Any], list[Any], bool, float, str]:
    """Parts of the objective, limits, whether squares are summed, −1 for a maximum, a title; every fault at once."""
    faults = []
    given = minimize if maximize is None else maximize
    if (minimize is None) == (maximize is None):
        faults.append("give either minimize= or maximize=: the name of a number, or a function of numbers by name")
    squares = isinstance(given, list | tuple)
    if squares and (maximize is not None or not given):
        faults.append(f"a sum of squares of a list can be minimized, not {'empty' if not given else 'maximized'}")
    if constraints is not None and not isinstance(constraints, Mapping):
        faults.append(
            f"constraints must map names to limits, such as {{'speed': (0.5, None)}}, not {shown(constraints)}"
        )
        constraints = None
    limits = []
    for title, each in (constraints or {}).items():
        row = _limit(title, each)
        if isinstance(row, str):
            faults.append(row)
        else:
            limits.append(row)
    if faults:
        raise ModelError(faults)
    word = "smallest" if maximize is None else "largest"
    name = "sum of squares" if squares else given if isinstance(given, str) else "objective"
    return list(given) if squares else [given], limits, squares, 1.0 if maximize is None else -1.0, f"{word} {name}"


def _limit(title: Any, given: Any) -> tuple[str, Any, float, float] | str:
    """(title, name or function, low, high), or what is wrong."""
    text = (
        f"the limits of {shown(title)} must be a number, (lowest, highest) with None for no limit, or (function, "
        f"lowest, highest), not {shown(given)}"
    )
    row = (given, given) if is_number(given) else given
    if not isinstance(title, str) or not isinstance(row, tuple | list) or len(row) not in (2, 3):
        return text
    function, *ends = (title, *row) if len(row) == 2 else row
    if not all(each is None or (is_number(each) and each == each) for each in ends):
        return text
    low, high = (empty if end is None else float(end) for end, empty in zip(ends, (-math.inf, math.inf), strict=True))
    return (title, function, low, high) if low <= high and (math.isfinite(low) or math.isfinite(high)) else text


def _method(method: Any, squares: bool, limited: bool) -> str:
    if method is None:
        return "least_squares" if squares and not limited else "SLSQP"
    if not among(method, METHODS):
        raise ModelError(f"method={shown(method)} is not available; use one of {', '.join(map(repr, METHODS))}")
    if method == "least_squares" and (limited or not squares):
        raise ModelError("method='least_squares' takes a list to minimize and no constraints; use 'SLSQP'")
    return str(method)


def _check_numbers(accuracy: Any, most: Any, progress: Any) -> None:
    faults = []
    if not is_number(accuracy) or not 1e-14 <= accuracy < 1.0:
        faults.append(f"accuracy must be a number between 1e-14 and 1, not {shown(accuracy)}")
    if isinstance(most, bool) or not isinstance(most, int) or not 1 <= most <= 1_000_000:
        faults.append(f"most must be a whole number of trials from 1, not {shown(most)}")
    if not isinstance(progress, bool):
        faults.append(f"progress must be True or False, not {shown(progress)}")
    if faults:
        raise ModelError(faults)


def _source(
    problem: Any, names: tuple[str, ...], guess: Vector, settings: tuple[Any, ...], functions: Functions, backend: str
) -> Source:
    """Where the numbers come from."""
    scales = {name: abs(float(value)) or 1.0 for name, value in zip(names, guess, strict=True)}
    if isinstance(problem, Model | Lagrangian):
        start, integrator, dt, tol, until = settings
        if until is None:
            raise ModelError("a run needs until=: a time [s], or the name of an event; a gait needs none")
        return RunSource(problem, start, integrator, dt, tol, until, functions, scales, backend)
    if not isinstance(problem, LimitCycle) and (not callable(problem) or isinstance(problem, type)):
        raise ModelError(
            "problem must be a model, a gait of mbd.limit_cycle, or a function of the unknowns by name, not "
            f"{shown(problem)}"
        )
    given = dict(zip(("start", "integrator", "dt", "tol", "until"), settings, strict=True)) | {"functions": functions}
    mine = [name for name, each in given.items() if each is not None and each != {}]
    if mine:
        raise ModelError(f"{', '.join(mine)}: for the runs of a model, which the problem is not, but {shown(problem)}")
    if isinstance(problem, LimitCycle):
        return GaitSource(problem, scales)
    return FunctionSource(problem, scales)


# result -------------------------------------------------------------------------------------------------------------
def _concluded(task: Problem, converged: bool | None, message: str, method: str, what: str) -> Optimum:
    best = task.best
    assert best is not None
    active, slope = ((), math.nan) if converged is None else _active(task, best)
    if converged is False and slope <= NOMINAL_RTOL:
        converged, message = True, f"no slope is left; {message}"
    made, violated = best.point.made, best.violation > max(HALF_PRECISION_RTOL, NOMINAL_RTOL)
    gait = made if isinstance(made, LimitCycle) else None
    values = task.values(best.u)
    if violated:
        message += f"; constraints are violated by {best.violation:.2g} of their scale"
    return Optimum(
        values, task.values(np.zeros(len(task.names))),
        {name: (float(a), float(b)) for name, a, b in zip(task.names, task.low, task.high, strict=True)},
        what, task.shown(best), dict(best.point.numbers),
        {limit.title: (float(value), limit.low, limit.high)
         for limit, value in zip(task.limits, best.limits, strict=True)},
        active, slope, best.violation, bool(converged) and not violated, message, method, tuple(task.trials), gait,
        None if isinstance(made, Mapping | LimitCycle) else made,
    )  # fmt: skip


def _active(task: Problem, best: Evaluated) -> tuple[tuple[Active, ...], float]:
    """What holds at the best trial with equality, and the derivative that it does not balance.

    The gradient is a combination of those of active limits, ``∇f = Σ price ∇c``, by least squares.
    """
    found: list[tuple[str, str, float, Vector]] = []
    x = np.array(list(task.values(best.u).values()))
    gradient, slopes = task.gradient(best) / task.scale, task.slopes(best)[1] / task.scale
    for k, name in enumerate(task.names):
        for side, end in (("lowest", task.low[k]), ("highest", task.high[k])):
            if abs(x[k] - end) <= NOMINAL_RTOL * task.scale[k]:
                found.append((name, side, float(end), np.eye(len(x))[k]))
    for k, limit in enumerate(task.limits):
        for side, end in (("lowest", limit.low), ("highest", limit.high)):
            if abs(best.limits[k] - end) <= NOMINAL_RTOL * task.limit_scale[k]:
                found.append((limit.title, "value" if limit.low == limit.high else side, float(end), slopes[k]))
                if limit.low == limit.high:
                    break
    if not found:
        return (), float(np.max(np.abs(gradient * task.scale)) / task.size)
    rows = np.array([line for *_, line in found]) * task.scale
    prices = np.linalg.lstsq(rows.T, gradient * task.scale, rcond=1e-10)[0]
    left = gradient * task.scale - prices @ rows
    sign = 1.0 if task.squares else task.sign
    active = tuple(
        Active(name, side, end, sign * float(price)) for (name, side, end, _), price in zip(found, prices, strict=True)
    )
    return active, float(np.max(np.abs(left)) / task.size)
