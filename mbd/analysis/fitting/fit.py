"""Least squares over runs, with exact derivatives: which parameters explain measured motion, and how well."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mbd.analysis.fitting.data import Data
from mbd.arrays import Matrix, Vector
from mbd.assembly.changed_start import changed_start, start_names
from mbd.bodies.values import among, is_number, number, shown
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.equal import DIRECT_PIVOT_RTOL, HALF_PRECISION_RTOL
from mbd.errors import MbdError, ModelError, SimulationError, UnknownNameError, nearest
from mbd.integrators import Integrator
from mbd.later import later
from mbd.notebook import table
from mbd.results.trajectory import Trajectory
from mbd.sensitivity.along import along
from mbd.sensitivity.starts import unknown_name
from mbd.simulation.interrupted import stopped
from mbd.simulation.run.memory import without_memory
from mbd.simulation.simulate import simulate
from mbd.state import State

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPANS = (1 / 16, 1 / 8, 1 / 4, 1 / 2)
"""Parts of the measured time that are fitted before all of it where the order of events changes [-]."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Parameters that explain measured motion best, and how well the data determine them.

    Attributes
    ----------
    values : estimates by name
    errors : their standard errors, s √((JᵀJ)⁻¹)ᵢᵢ with s² the sum of squares over its degrees of freedom; infinite for
        those that the data cannot tell apart, and for all without degrees of freedom
    predicted : standard errors √((JᵀJ)⁻¹)ᵢᵢ if the scales `sigma` of the data are their true errors
    correlation : of the estimates (P, P)
    alike : groups of names whose effects on the data cannot be told apart
    residuals : measured less computed, over the scale of its column, by name
    noise : s, the size of the residuals [-]; infinite, since unknown, without degrees of freedom
    degrees : of freedom: values less the parameters that they can tell apart [-]
    converged, message : of the search; runs : made for it
    times : of the residuals, by name [s]; scales : that they are divided by
    run : the run with the estimates
    """

    values: Mapping[str, float]
    errors: Mapping[str, float]
    predicted: Mapping[str, float]
    correlation: Matrix
    alike: tuple[tuple[str, ...], ...]
    residuals: Mapping[str, Vector]
    times: Mapping[str, Vector]
    scales: Mapping[str, float]
    noise: float
    converged: bool
    message: str
    runs: int
    degrees: int
    run: Trajectory = field(repr=False)

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Confidence interval of an estimate, by Student's distribution."""
        from scipy.stats import t

        if not among(name, self.values):
            raise UnknownNameError(nearest(name, self.values, "estimate"))
        if not 0.0 < number(level, "level of interval") < 1.0:
            raise ModelError(f"level of interval must lie between 0 and 1, such as 0.95, got {level!r}")
        half = float(t.ppf(0.5 + 0.5 * float(level), max(self.degrees, 1))) * self.errors[name]
        return self.values[name] - half, self.values[name] + half

    def together(self, above: float = 0.99) -> list[tuple[str, str, float]]:
        """Pairs of estimates whose correlation has a size above a limit: the data tell them apart badly."""
        names, known = list(self.values), [math.isfinite(each) for each in self.errors.values()]
        pairs = [(i, j) for i in range(len(names)) for j in range(i + 1, len(names)) if known[i] and known[j]]
        found = [(names[i], names[j], float(self.correlation[i, j])) for i, j in pairs]
        return [pair for pair in found if abs(pair[2]) > above]

    def plot(self, path: str | Path | None = None) -> Figure:
        """Residuals over time, each in its own panel, beside measured and computed values; the figure."""
        figure: Figure = later("Fit.plot")(self, path)
        return figure

    def _lines(self) -> list[list[str]]:
        found = []
        for name, value in self.values.items():
            low, high = self.interval(name)
            found.append([name, f"{value:.8g}", f"{self.errors[name]:.2g}", f"{low:.6g} … {high:.6g}"])
        return found

    def __repr__(self) -> str:
        lines = [["parameter", "estimate", "standard error", "95 %"], *self._lines()]
        widths = [max(len(line[k]) for line in lines) for k in range(4)]
        text = ["  ".join(f"{cell:>{width}}" for cell, width in zip(line, widths, strict=True)) for line in lines]
        text += [f"the data cannot tell apart: {', '.join(names)}" for names in self.alike]
        text += [f"{one} and {other} go together: correlation {value:.5f}" for one, other, value in self.together()]
        return "\n".join([*text, self.message])

    def _repr_html_(self) -> str:
        return table("Fit", ("parameter", "estimate", "standard error", "95 %"), self._lines())


def fit(
    model: Any,
    start: State,
    data: Any,
    parameters: Mapping[str, Any],
    integrator: Integrator | None = None,
    dt: float | None = None,
    tol: float | None = None,
    *,
    events: Mapping[str, float] | None = None,
    sigma: Mapping[str, float] | None = None,
    until: float | None = None,
    backend: str = "auto",
) -> Fit:
    """Find the parameters with which a model moves as it was measured: nonlinear least squares.

    Minimises Σ ((measured − computed)/σ)² over parameters within bounds by a trust-region method
    (`scipy.optimize.least_squares`; Branch, Coleman & Li, SIAM J. Sci. Comput. 21, 1999) with the exact derivatives of
    the runs, through impacts and shifts of their instants (see `mbd.sensitivities`).

    Where the order of events changes on the way, as of phases of a machine, the sum of squares is not smooth and may
    have several minima. Then the data are also fitted over a growing time, from a sixteenth to all of it, each search
    beginning where the last one ended, and the smaller sum stays.

    Parameters
    ----------
    data : a table, a dictionary or a pandas DataFrame, with a column 'time' [s] and columns by names of results; NaN
        where a value is missing; None where only events were measured
    parameters : what to find, by name: a guess, ``{"shank.mass": 3.0}``, or (guess, lowest, highest). Coordinates and
        rates of the start, ``{"knee.angle": 0.6, "knee.rate": 0.0}``, can be found too; others complete the start as
        by `mbd.assemble`, with the least motion
    integrator, dt, tol : see `mbd.simulate`; of the Newmark family, `mbd.RungeKutta853` or `mbd.RadauIIA`. Without
        either dt is 1 ms. With `tol` each run chooses its steps, which its derivatives hold: residuals are then as
        exact as `tol` says, and the search cannot come closer than that
    events : measured instants [s], ``{"right foot.time": 0.71, "right foot.time.2": 1.44}``
    sigma : standard deviation of the errors of a column or an instant, which weighs it; by default a hundredth of its
        range. The size of the errors is estimated from the residuals
    until : end of the runs [s]; by default the time of the last value, or some time behind it where events are fitted

    Returns
    -------
    Fit
        of the best trial where Ctrl-C ended the search

    Raises
    ------
    ModelError, UnknownNameError
        for data, names and bounds that cannot be, all at once.
    SimulationError, CapabilityError
        if the run with the guesses fails, does not reach the data, or cannot be differentiated.

    Examples
    --------
    The length of a pendulum from its swing.

    >>> import mbd, numpy as np
    >>> model = mbd.Model("pendulum")
    >>> rod = mbd.Link("rod", mass=1.0, length=1.3, center=1.3)
    >>> model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(0.2)))
    >>> start = mbd.assemble(model, {"pin.angle": 0.4})
    >>> times = np.linspace(0.1, 2.0, 20)
    >>> seen = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.02, until=2.0).at(times)["pin.angle"]
    >>> data, guess = {"time": times, "pin.angle": seen}, {"rod.center": 1.0, "pin loss.coefficient": 0.5}
    >>> found = mbd.fit(model, start, data, guess, mbd.RungeKutta853(), dt=0.02)
    >>> print({name: round(value, 6) for name, value in found.values.items()})
    {'rod.center': 1.3, 'pin loss.coefficient': 0.2}
    """
    if not isinstance(start, State):
        raise ModelError(f"start must be a State from mbd.assemble(model, …), not {shown(start)}")
    known = Data.read(data, events, sigma, start.time)
    guess, low, high = bounds(parameters)
    dt = 1e-3 if dt is None and tol is None else dt
    end = _end(known, start.time, until, dt, tol)
    search = _Search(model, start, known, tuple(parameters), integrator, dt, tol, end, backend)
    search.check()
    first = search.residuals(guess)
    if not np.all(np.isfinite(first)):
        raise SimulationError(f"the run with the guesses does not reach the data: {search.problem}", search.run)
    order = order_of(search.run)
    try:
        found = search.least(guess, low, high)
        if order_of(search.made(found.x)) != order:
            found = min(found, search.least_over_growing_spans(guess, low, high), key=lambda each: float(each.cost))
    except KeyboardInterrupt:
        if search.best is None:
            raise
        found = search.best
        search.at, search.run = found.x, found.run
    return search.concluded(found)


def bounds(parameters: Any) -> tuple[Vector, Vector, Vector]:
    """Guesses and bounds; every fault at once."""
    if not isinstance(parameters, Mapping) or not parameters:
        raise ModelError(
            f"parameters must map names to guesses, such as {{'shank.mass': 3.0}}, not {shown(parameters)}"
        )
    faults, rows = [], []
    for name, each in parameters.items():
        row = (each, -math.inf, math.inf) if is_number(each) else each
        numbers = isinstance(row, tuple | list) and len(row) == 3 and all(is_number(x) and x == x for x in row)
        if not isinstance(name, str) or not numbers or not math.isfinite(row[0]) or not row[1] < row[0] < row[2]:
            faults.append(
                f"the guess of {name!r} must be a number, or (guess, lowest, highest) in order, not {shown(each)}"
            )
        else:
            rows.append([float(x) for x in row])
    if faults:
        raise ModelError(faults)
    guess, low, high = np.array(rows).T
    return guess, low, high


def _end(data: Data, begin: float, until: Any, dt: Any, tol: Any) -> float:
    for name, value, what in (("dt", dt, "step [s]"), ("tol", tol, "tolerance")):
        if value is not None and (not is_number(value) or not 0.0 < value < math.inf):
            raise ModelError(f"{name} must be a positive {what}, not {shown(value)}")
    if until is None:
        return float(data.last + (max(2.0 * (dt or 0.0), 0.2 * (data.last - begin)) if data.events else 0.0))
    if not is_number(until) or not data.last <= until < math.inf:
        raise ModelError(f"until must be a time [s] not before the last value at {data.last:g} s, not {shown(until)}")
    return float(until)


@dataclass(frozen=True, eq=False)
class _Trial:
    """A trial of a search, in the words of `scipy.optimize.least_squares`."""

    x: Vector
    fun: Vector
    jac: Matrix
    run: Trajectory
    status: int = 0
    message: str = "interrupted; this is the best trial so far"


@dataclass
class _Search:
    """Runs for given values, and their differences from the data."""

    model: Any
    start: State
    data: Data
    names: tuple[str, ...]
    integrator: Integrator | None
    dt: float | None
    tol: float | None
    until: float
    backend: str
    of_start: tuple[str, ...] = ()
    runs: int = 0
    problem: str = ""
    run: Trajectory | None = None
    at: Vector | None = None
    left: Vector | None = None
    best: _Trial | None = None

    def check(self) -> None:
        """Names that the model does not have, all at once; parameters that are 0 or ±1 become inputs."""
        mechanism = mechanism_of(self.model, self.backend, self.start.parameters)
        equations = mechanism.equations
        inputs = {parameter.name for parameter in equations.parameters}
        declared = {*inputs, *getattr(self.model, "parameters", {})}
        begins = start_names(mechanism)
        self.of_start = tuple(name for name in self.names if name not in declared and name in begins)
        what, known = "parameter, coordinate or rate of the start", {*declared, *begins}
        wrong = [unknown_name(equations, name, known, what) for name in self.names if name not in known]
        if wrong:
            raise UnknownNameError(wrong)
        for name in self.data.columns:
            equations.output(name)
        more = [name for name in self.names if name not in {*inputs, *self.of_start}]
        self.model = self.model.with_tunable(*more) if more else self.model

    def made(self, values: Vector) -> Trajectory | None:
        """The run with these values; None if it fails."""
        if self.at is not None and np.array_equal(values, self.at):
            return self.run
        self.at, self.run, self.left = values.copy(), None, None
        self.runs += 1
        try:
            given = dict(zip(self.names, map(float, values), strict=True))
            own = {name: given.pop(name) for name in self.of_start}
            start = changed_start(self.model, self.start, own, given, self.backend) if own else self.start
            self.run = simulate(
                self.model, without_memory(start), self.integrator, self.dt, self.tol, until=self.until,
                contact="events", parameters=given, on_failure="return", backend=self.backend,
            )  # fmt: skip
        except MbdError as error:
            self.problem = str(error)
        if self.run is not None and stopped(self.run):
            raise KeyboardInterrupt
        return self.run

    def residuals(self, values: Vector) -> Vector:
        """Computed less measured, over the scales; infinite where the run does not get there."""
        run = self.made(values)
        if self.left is None:
            self.left = self._left(run)
        return self.left.copy()

    def _left(self, run: Trajectory | None) -> Vector:
        if run is None or run.time[-1] < max((times[-1] for times, _ in self.data.columns.values()), default=-math.inf):
            self.problem = self.problem if run is None else run.message
            return np.full(self.data.count, np.inf)
        alike = dict[bytes, list[str]]()
        for name, (times, _) in self.data.columns.items():
            alike.setdefault(times.tobytes(), []).append(name)
        read = dict[str, Vector]()
        for names in alike.values():
            read |= run.at(self.data.columns[names[0]][0]).read(*names)
        parts = list[Vector]()
        for name, (times, seen) in self.data.columns.items():
            computed = read[name] if np.isfinite(read[name]).all() else run.at(times)[name]  # which says what is wrong
            parts.append((computed - seen) / self.data.scales[name])
        for name, instant in self.data.events.items():
            found = instants_of(run).get(name, math.inf)
            if not math.isfinite(found):
                self.problem = f"there is no {name!r}: " + nearest(name, instants_of(run), "instant", "There are")
            parts.append(np.array([(found - instant) / self.data.scales[name]]))
        return np.concatenate(parts)

    def least(self, guess: Vector, low: Vector, high: Vector, most: int = 200) -> Any:
        """The search from a guess within bounds, of at most so many steps.

        Estimates are sought over powers of two near their guesses, residuals over the size that they have there: then
        a search ends at the same estimates whatever units and `sigma` are.
        """
        from scipy.optimize import least_squares

        scale = 2.0 ** np.round(np.log2(np.abs(np.where(guess == 0.0, 1.0, guess))))
        size = float(np.linalg.norm(self.residuals(guess))) or 1.0

        def residuals(u: Vector) -> Vector:
            return self.residuals(scale * u) / size

        def slopes(u: Vector) -> Matrix:
            return self.slopes(scale * u) * scale / size

        found: Any = least_squares(
            residuals, guess / scale, slopes, (low / scale, high / scale), x_scale="jac", xtol=1e-9, ftol=1e-12,
            gtol=1e-12, max_nfev=most,
        )  # fmt: skip
        found.x, found.fun, found.jac, found.cost = (
            scale * found.x, size * found.fun, size / scale * found.jac, size**2 * found.cost
        )  # fmt: skip
        return found

    def least_over_growing_spans(self, guess: Vector, low: Vector, high: Vector) -> Any:
        """The search from where those over the first parts of the time have ended, one after another."""
        values, begin = guess, float(self.start.time)
        for part in SPANS:
            end = begin + part * (self.data.last - begin)
            known = self.data.until(end)
            if not known.count:
                continue
            search = replace(self, data=known, until=_end(known, begin, None, self.dt, self.tol), runs=0, at=None)
            if np.all(np.isfinite(search.residuals(values))):
                # so many steps at most: parameters that a part of the time does not tell of would wander on
                values = search.least(values, low, high, 20).x
            self.runs += search.runs
        return (
            self.least(values, low, high)
            if np.all(np.isfinite(self.residuals(values)))
            else self.least(guess, low, high)
        )

    def slopes(self, values: Vector) -> Matrix:
        """Derivatives of the residuals (values, parameters)."""
        run = self.made(values)
        assert run is not None  # least_squares asks where residuals were finite
        names = list(self.data.columns)
        found = along(run, self.names, names, self.of_start)
        parts = [found.at(self.data.columns[name][0])[:, k] / self.data.scales[name] for k, name in enumerate(names)]
        for name in self.data.events:
            line = found.of_instant(name.split(".time")[0], instants_of(run)[name])
            parts.append(line[None] / self.data.scales[name])
        jacobian, residuals = np.vstack(parts), self.residuals(values)
        if self.best is None or residuals @ residuals < self.best.fun @ self.best.fun:
            self.best = _Trial(values.copy(), residuals, jacobian, run)
        return jacobian

    def concluded(self, found: Any) -> Fit:
        """What the search has found."""
        run = self.made(found.x)
        assert run is not None
        sizes = np.linalg.norm(found.jac, axis=0)
        scaled = found.jac / np.where(sizes > 0.0, sizes, 1.0)
        # all directions among the parameters, but none of the many among the values
        _, strengths, directions = np.linalg.svd(scaled, full_matrices=len(scaled) < len(self.names))
        strengths = np.pad(strengths, (0, len(directions) - len(strengths)))
        weak = strengths <= HALF_PRECISION_RTOL * max(strengths[0], 1e-300)
        degrees = len(found.fun) - int(np.count_nonzero(~weak))
        noise = math.sqrt(float(np.sum(found.fun**2)) / degrees) if degrees else math.inf
        free, groups = _told_apart(directions[weak])
        covariance = (directions.T * np.where(weak, 0.0, 1.0 / np.where(weak, 1.0, strengths) ** 2)) @ directions
        deviation = np.sqrt(np.diag(covariance))
        errors = np.where(free, np.inf, deviation / np.where(sizes > 0.0, sizes, 1.0))
        times = {name: seen[0] for name, seen in self.data.columns.items()}
        times |= {name: np.array([instant]) for name, instant in self.data.events.items()}
        return Fit(
            dict(zip(self.names, map(float, found.x), strict=True)),
            dict(zip(self.names, map(float, np.where(np.isinf(errors), np.inf, noise * errors)), strict=True)),
            dict(zip(self.names, map(float, errors), strict=True)),
            covariance / np.maximum(np.outer(deviation, deviation), 1e-300),
            tuple(tuple(self.names[k] for k in group) for group in groups), self._by_name(found.fun), times,
            self.data.scales, noise, found.status > 0, self._said(found, degrees), self.runs, degrees, run,
        )  # fmt: skip

    def _said(self, found: Any, degrees: int) -> str:
        """Why the search ended; estimates at a bound; that nothing tells errors; how exact runs of own steps are."""
        message = str(found.message)
        sides = zip(self.names, getattr(found, "active_mask", ()), strict=False)
        if bounded := ", ".join(repr(name) for name, side in sides if side):
            message += f" At a bound, beyond which the data would have it: {bounded}; no interval holds there."
        if not degrees:
            message += f" As few as {self.data.count} values tell nothing of the errors of estimates."
        return message if self.tol is None else f"{message} Steps follow tol={self.tol:g} and are held in derivatives."

    def _by_name(self, residuals: Vector) -> dict[str, Vector]:
        """Measured less computed, by name."""
        lengths = [len(seen) for _, seen in self.data.columns.values()] + [1] * len(self.data.events)
        parts = np.split(-residuals, np.cumsum(lengths)[:-1])
        return dict(zip([*self.data.columns, *self.data.events], parts, strict=True))


def _told_apart(nothing: Matrix) -> tuple[NDArray[np.bool_], list[list[int]]]:
    """Which parameters move along directions that leave the data as they are (k, P), and those that do so together.

    Any basis of these directions will do: what counts is the projection on them.
    """
    from scipy.sparse.csgraph import connected_components

    share = np.linalg.norm(nothing, axis=0)
    free = share > DIRECT_PIVOT_RTOL
    beside = np.abs(nothing.T @ nothing) > DIRECT_PIVOT_RTOL * np.outer(share, share)
    number, group = connected_components(beside & np.outer(free, free))
    groups = [np.flatnonzero(free & (group == k)).tolist() for k in range(number)]
    return free, [members for members in groups if members]


def order_of(run: Trajectory | None) -> list[tuple[str, str]]:
    """Kinds and names of the events of a run, one after the other."""
    return [] if run is None else [(event.kind, event.name) for event in run.events]


def instants_of(run: Trajectory) -> dict[str, float]:
    """Instants at which contacts closed and events happened, 'foot.time' of the first, 'foot.time.2' of the second."""
    found: dict[str, float] = {}
    counts: dict[str, int] = {}
    for event in (each for each in run.events if each.kind in ("closed", "event")):
        counts[event.name] = counts.get(event.name, 0) + 1
        number = counts[event.name]
        found[f"{event.name}.time" + (f".{number}" if number > 1 else "")] = float(event.time)
    return found
