"""What a run is asked to be differentiated by, and what is made of the derivatives that it carries."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from mbd.bodies.values import among, is_finite_number, is_number, shown
from mbd.compile.mechanisms import mechanism_of, tunable_model
from mbd.dataclass import changed_late, dataclass
from mbd.equal import EQUAL_RTOL
from mbd.equations.equations import Equations
from mbd.errors import CapabilityError, ModelError, UnknownNameError, nearest
from mbd.integrators import Integrator
from mbd.notes import doubt
from mbd.results.facts import Facts
from mbd.results.trajectory import Trajectory
from mbd.results.units import unit
from mbd.sensitivity.derivative import Differentiated, passed
from mbd.sensitivity.made_run import made_with
from mbd.sensitivity.outputs import lines_of, taken_apart, usual
from mbd.sensitivity.result import Sensitivities, words_of
from mbd.sensitivity.run_data import ADVICE, Source, refused
from mbd.sensitivity.starts import Direction, restitution_names
from mbd.sensitivity.tangent_names import refuse_parts, start_names, whole_names
from mbd.simulation.marching import Run
from mbd.simulation.run.memory import without_memory
from mbd.state import State
from mbd.tape.derivatives import jvp
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Tape
from mbd.tape.tracing import traced_scalar

Wanted = str | Mapping[str, Mapping[str, Any]]


@dataclass
class Asked:
    """Derivatives of a run, which it carries where it can (`mbd.sensitivity.made_run`).

    wrt, of, at, hold : see `mbd.sensitivities`, which has checked them; found : what was asked for, after the run
    """

    wrt: Sequence[Wanted]
    of: Sequence[str] | None = None
    at: Mapping[str, float] = field(default_factory=dict)
    hold: Sequence[str] | None = None
    found: Any = None

    def differentiable(
        self, model: Any, start: State, changed: Mapping[str, float], options: dict[str, Any]
    ) -> tuple[Any, State]:
        """The model with what it is differentiated by as inputs, and a start without memory."""
        return model, start

    def begun(self, *given: Any) -> Run:
        """The run itself, from what `Run` takes."""
        return made_with(self._ways, *given)

    def of_run(self, run: Trajectory) -> tuple[list[Any], Sequence[str]]:
        """Directions by the parameters of a run, and names of its start that stay."""
        return self._ways(dict(zip(run.record.parameter_names, run.record.parameters, strict=False)))

    def _ways(self, known: Mapping[str, float]) -> tuple[list[Any], Sequence[str]]:
        single, grouped = names_in(self.wrt)
        found: list[Any] = list(single)
        if grouped:
            found = []
            for each in self.wrt:
                if isinstance(each, str):
                    found.append(each)
                else:
                    found += [(name, _rates_of_parameters(name, given, self.at, known)) for name, given in each.items()]
        of_start = [name for name in single if name not in known]
        return found, of_start if self.hold is None else self.hold

    def conclude(self, run: Trajectory, made: Run, model: Any, scheme: Integrator) -> None:
        """Find what was asked for of a run that has come to its end.

        Raises
        ------
        CapabilityError
            where it has no derivatives; with the run.
        """
        try:
            self.take(run, *passed(run, *self.of_run(run), self.source(model, scheme), made))
        except CapabilityError as error:
            error.run = run
            raise
        _doubt_derivatives(run, made)

    def source(self, model: Any, scheme: Integrator) -> Source | None:
        """What made the run."""
        return Source(model, scheme)

    def take(self, run: Trajectory, found: Differentiated, wanted: Sequence[Direction]) -> None:
        """What was asked for, from the derivatives at the end and at events."""
        raise NotImplementedError


class Table(Asked):
    """Derivatives of results as a table."""

    def take(self, run: Trajectory, found: Differentiated, wanted: Sequence[Direction]) -> None:
        self.found = Sensitivities(run=run, **self.fields(found, wanted))

    def fields(self, found: Differentiated, wanted: Sequence[Direction]) -> dict[str, Any]:
        """Fields of `Sensitivities` but for the run."""
        rows = found.rows
        names = usual(rows) if self.of is None else taken_apart(rows, self.of)
        lines = lines_of(rows, found.programs, found.walked, names)
        columns = tuple(each.name for each in wanted)
        of_units, wrt_units = rows.mechanism.kept(
            (Table, lines.names, columns), lambda: _units(lines.names, columns, rows.run.facts)
        )
        written = tuple(dict.fromkeys(name for each in rows.controllers for name in each.writes))
        return {
            "of": lines.names, "wrt": columns, "matrix": lines.matrix, "values": lines.values,
            "of_units": of_units, "wrt_units": wrt_units, "written": written,
        }  # fmt: skip


class EndState(Asked):
    """What a pass over a run finds, by directions of its start and of parameters; controllers are refused."""

    def __init__(self, wanted: Sequence[Direction]) -> None:
        super().__init__(())
        self.wanted = wanted

    def _ways(self, known: Mapping[str, float]) -> tuple[list[Any], Sequence[str]]:
        return list(self.wanted), ()

    def source(self, model: Any, scheme: Integrator) -> Source | None:
        return None

    def take(self, run: Trajectory, found: Differentiated, wanted: Sequence[Direction]) -> None:
        self.found = found.walked


class Carried(Table):
    """Derivatives that a run takes into files: ``mbd.simulate(…, wrt=…)``.

    controllers : see `mbd.simulate`
    """

    controllers: Any = None

    def differentiable(
        self, model: Any, start: State, changed: Mapping[str, float], options: dict[str, Any]
    ) -> tuple[Any, State]:
        if options["locate"] != "root":
            raise CapabilityError("wrt= needs locate='root'; leave it out")
        if options["contact"] == "auto":
            options["contact"] = "events"
        model = with_inputs(model, options["backend"], changed, self.wrt, self.controllers)
        groups = [by for each in self.wrt if not isinstance(each, str) for by in each.values()]
        if any(callable(rate) for by in groups for rate in by.values()):
            raise ModelError(
                "wrt takes rates of parameters here, such as 9.8; mbd.sensitivities(…, at=…) takes functions"
            )
        return model, without_memory(start)

    def take(self, run: Trajectory, found: Differentiated, wanted: Sequence[Direction]) -> None:
        fields = self.fields(found, wanted)
        changed_late(run.record, "stats", lambda stats: stats | {"sensitivities": words_of(fields)})


def _doubt_derivatives(run: Trajectory, made: Run) -> None:
    """Warn where steps of fixed size are long for the motion: derivatives lose their digits before the motion does."""
    spent, fastest = float(made.kernel.error_sum), float(np.max(np.abs(run.record.v), initial=0.0))
    # derivatives of random mechanisms were off by 2 to 30 times that share
    if made.kernel.estimates and not made.kernel.adaptive and spent > 0.01 * fastest:
        doubt(
            f"the derivatives are in doubt: estimated errors of velocities add up to {spent:.2g} m/s or rad/s over all "
            f"steps, {100.0 * spent / fastest:.2g} % of the largest velocity, and derivatives err by several times "
            "that share; use a smaller dt, or tol="
        )


def _units(of: Sequence[str], wrt: Sequence[str], facts: Facts) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Units of results and of what they are differentiated by."""
    return (
        tuple("s" if name == "time" or ".time" in name else unit(name, facts) for name in of),
        tuple("rad" if ".turn." in name else unit(name, facts) for name in wrt),
    )


def request_of(wrt: Any, controllers: Any) -> Asked:
    """What `mbd.simulate` was asked for by ``wrt=``."""
    if isinstance(wrt, Asked):
        return wrt
    found = Carried(wrt)
    found.controllers = controllers
    return found


def names_in(wrt: Any) -> tuple[list[str], list[str]]:
    """Names of single quantities, and of the parameters that functions give."""
    if isinstance(wrt, str | bytes) or not isinstance(wrt, Sequence) or not len(wrt):
        raise ModelError(f"wrt must be a list of names such as ['hip.angle', 'hip.mass'], not {shown(wrt)}")
    if set(map(type, wrt)) == {str}:
        return list(wrt), []
    single, grouped = list[str](), list[str]()
    for each in wrt:
        if isinstance(each, str):
            single.append(each)
        elif isinstance(each, Mapping) and each and all(isinstance(v, Mapping) and v for v in each.values()):
            grouped += [name for functions in each.values() for name in functions]
            rates = [rate for functions in each.values() for rate in functions.values() if is_number(rate)]
            if not all(map(is_finite_number, rates)):
                raise ModelError(f"wrt: rates of parameters must be finite numbers, or functions, not {shown(each)}")
        else:
            raise ModelError(
                f"wrt: expected names, or functions of parameters {{name: {{parameter: function}}}}, not {shown(each)}"
            )
    return single, grouped


def _check_controllers(own: Sequence[Any], asked: Any, names: Collection[str]) -> None:
    """Refuse the controllers of a model unless what they write is to be held, and derivatives by what they write."""
    if not among(asked, (None, "held")):
        raise ModelError(f"controllers={shown(asked)} is not available; use 'held', or leave it out")
    if own and asked is None:
        them = ", ".join(repr(each.name) for each in own)
        raise refused(
            f"its controllers ({them}) change parameters as they read results, which is not differentiated",
            ADVICE,
        )
    for each in own:
        for name in each.writes:
            if name in names:
                raise refused(f"{name!r} is held as {each.name!r} writes it", "leave it out of wrt")


def with_inputs(model: Any, backend: str, changed: Mapping[str, float], wrt: Any, controllers: Any = None) -> Any:
    """The model with the parameters that `wrt` names as run-time inputs, also where they are 0 or ±1."""
    single, grouped = names_in(wrt)
    _check_controllers(getattr(model, "controllers", ()), controllers, {*single, *grouped})
    mechanism = mechanism_of(model, backend, {k: v for k, v in changed.items() if is_number(v)})
    more = mechanism.kept(
        (with_inputs, *single, *grouped), lambda: _folded_of(mechanism.equations, model, single, grouped)
    )
    return tunable_model(model, more) if more else model


def _folded_of(equations: Equations, model: Any, single: Sequence[str], grouped: Sequence[str]) -> list[str]:
    """Which of these names are parameters of the model that its equations do not have as inputs."""
    if _names_of(equations).issuperset((*single, *grouped)):
        return []
    folded, own = getattr(model, "parameters", {}), _names_of(equations)
    known = {*own, *folded, *restitution_names(equations)}
    whole = whole_names(equations)
    for name in (*single, *grouped):
        if name not in known and not (name in whole and name in single):
            refuse_parts(equations, [name], "wrt")
            raise UnknownNameError(
                "wrt: " + nearest(name, known, "coordinate, rate of the start or parameter", "There are")
            )
    inputs = _inputs_of(equations)
    return [name for name in (*single, *grouped) if name in folded and name not in inputs]


def _names_of(equations: Equations) -> frozenset[str]:
    """Parameters, coordinates, and what else a start has."""
    return _inputs_of(equations).union(start_names(equations))


def _inputs_of(equations: Equations) -> frozenset[str]:
    """Parameters and coordinates."""
    return frozenset([*(each.name for each in equations.parameters), *(each.name for each in equations.coordinates)])


def _rates_of_parameters(
    name: str, functions: Mapping[str, Any], at: Mapping[str, float], known: Mapping[str, float]
) -> dict[str, float]:
    """Derivatives of parameters by a quantity on which they depend.

    Parameters
    ----------
    functions : of one scalar, by the name of the parameter that they give; or a number, the derivative itself
    at : the value of each quantity
    known : the parameters of the run, which the functions must give

    Raises
    ------
    ModelError
        where the value is missing, or functions give other parameters than the run has.
    """
    rates: dict[str, float] = {}
    for parameter, function in functions.items():
        if is_number(function):
            rates[parameter] = float(function)
            continue
        if not callable(function):
            raise ModelError(f"wrt: {parameter!r} of {name!r} must be a function or a number, not {shown(function)}")
        if name not in at:
            raise ModelError(f"wrt: {name!r} is a function of parameters: give its value too, as at={{{name!r}: 0.05}}")
        tape = Tape()
        place = tape.input("p", 0)
        node = traced_scalar(function, [(name, place)], f"{parameter!r} as a function of {name!r}", tape)
        value, rate = evaluate([node, *jvp([node], {place: 1.0})], {("p", 0): at[name]})
        present = known.get(parameter)
        if present is not None and not abs(value - present) <= EQUAL_RTOL * max(abs(present), abs(value), 1e-3):
            raise ModelError(
                f"wrt: {parameter!r} is {value:.9g} at {name} = {at[name]:.9g}, but {present:.9g} in the run; give the "
                "run these parameters, or at= the value that it has"
            )
        rates[parameter] = rate
    return rates
