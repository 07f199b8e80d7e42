"""Numbers of runs with their exact derivatives."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mbd.assembly.changed_start import changed_start, start_names
from mbd.bodies.values import is_number, shown
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.errors import MbdError, ModelError, TraceError, UnknownNameError
from mbd.integrators import Integrator
from mbd.optimization.points import DIFFERENCE_STEP, Point, Source, failed, slope_by_differences, table_point
from mbd.results.trajectory import Trajectory
from mbd.sensitivity.sensitivities import sensitivities
from mbd.sensitivity.starts import unknown_name
from mbd.state import State
from mbd.tape.derivatives import jvp
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Tape

Functions = Mapping[str, Callable[[Any], Mapping[str, Any]]]


@dataclass(eq=False)
class RunSource(Source):
    """Runs from a start, which may be unknown too, to a time or an event."""

    model: Any
    start: State
    integrator: Integrator | None
    dt: float | None
    tol: float | None
    until: Any
    functions: Functions
    scales: Mapping[str, float]
    backend: str
    kind = "result"

    def __post_init__(self) -> None:
        if not isinstance(self.start, State):
            raise ModelError(f"start must be a State from mbd.assemble(model, …), not {shown(self.start)}")
        if not isinstance(self.functions, Mapping) or not all(map(callable, self.functions.values())):
            raise ModelError(
                "functions must map names to functions that give parameters, such as {'slope': lambda s: "
                f"{{'gravity.x': 9.81 * mbd.sin(s)}}}}, not {shown(self.functions)}"
            )
        mechanism = mechanism_of(self.model, self.backend, self.start.parameters)
        declared = {parameter.name for parameter in mechanism.equations.parameters} | set(
            getattr(self.model, "parameters", {})
        )
        begins = start_names(mechanism)
        known = {*declared, *begins, *self.functions}
        what = "parameter, function of parameters, coordinate or rate of the start"
        wrong = [unknown_name(mechanism.equations, name, known, what) for name in self.scales if name not in known]
        if wrong:
            raise UnknownNameError(wrong)
        self.of_start = [name for name in self.scales if name in begins and name not in {*declared, *self.functions}]

    def check(self, name: str) -> None:
        """Results are known when a run has been made: events happen or not."""

    def at(self, values: Mapping[str, float], wanted: Sequence[str]) -> Point:
        """The results of the run at these values."""
        own = {name: values[name] for name in self.of_start}
        plain = {name: value for name, value in values.items() if name not in {*own, *self.functions}}
        rates = {name: self._moved(name, values[name]) for name in values if name in self.functions}
        for moved in rates.values():
            plain |= {name: value for name, (value, _) in moved.items()}
        wrt: list[Any] = [
            {name: {key: rate for key, (_, rate) in rates[name].items()}} if name in rates else name for name in values
        ]
        try:
            bound = self.start.mode.closed or mechanism_of(self.model, self.backend, plain).equations.rows
            start = changed_start(self.model, self.start, own, plain, self.backend) if own or bound else self.start
            found = sensitivities(
                self.model, start, self.integrator, self.dt, self.tol, until=self.until, wrt=wrt,
                of=[*wanted, "time"] if "time" not in wanted else list(wanted), hold=self.of_start, parameters=plain,
                backend=self.backend,
            )  # fmt: skip
        except MbdError as error:
            return failed(values, error)
        why = self._ended(found.run)
        return Point(values, outcome=why, made=found.run) if why else table_point(found, values)

    def _ended(self, run: Trajectory) -> str:
        """'' for a run that came to its end; else what ended it."""
        if is_number(self.until):
            if run.time[-1] >= self.until - 1e-9 * max(1.0, abs(self.until)):
                return ""
        else:
            name = self.until if isinstance(self.until, str) else self.until[0]
            if run.status == 0:
                return f"{name!r} does not happen by {run.time[-1]:.3g} s"
            if run.message.startswith(f"ended by {name!r} "):  # others may happen at the same instant
                return ""
        return run.message.replace("ended", "ends", 1)

    def _moved(self, name: str, value: float) -> dict[str, tuple[float, float]]:
        """(value, rate) of each parameter that a quantity moves."""
        function, tape = self.functions[name], Tape()
        node = tape.input("p", 0)
        try:
            given = {key: tape.lift(each) for key, each in function(node).items()}
        except TraceError:  # of math instead of mbd
            return {key: (float(function(value)[key]), self._slope(name, key, value)) for key in function(value)}
        at: dict[Any, float] = {("p", 0): value}
        return {
            key: (evaluate([each], at)[0], evaluate(jvp([each], {node: 1.0}), at)[0]) for key, each in given.items()
        }

    def _slope(self, name: str, key: str, value: float) -> float:
        """The rate of a function of plain numbers."""
        function = self.functions[name]
        return slope_by_differences(lambda at: float(function(at)[key]), value, self.scales[name], DIFFERENCE_STEP, 6)
