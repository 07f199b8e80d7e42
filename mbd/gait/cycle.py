"""A gait that repeats itself: its start, step, stability and cost, and how they follow parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.arrays import ComplexArray, Vector
from mbd.bodies.values import named_number_faults
from mbd.dataclass import dataclass
from mbd.errors import GaitError, ModelError
from mbd.gait.derivatives import Derivatives, require_member, step_spans
from mbd.gait.family import energy_of
from mbd.gait.floquet import Multipliers
from mbd.gait.map_derivative import MapDerivative, Measured, measured
from mbd.gait.outcome import Outcome
from mbd.gait.return_map import Arrival, ReturnMap
from mbd.gait.section import Chart
from mbd.later import later
from mbd.notebook import table
from mbd.results.ledger import SPENT, titled
from mbd.results.trajectory import Trajectory
from mbd.sensitivity.tangent_names import place_names
from mbd.simulation.simulate import simulate
from mbd.state import State

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class LimitCycle:
    """A gait, from just after an event to the next such state, sides exchanged where it was asked for.

    Attributes
    ----------
    name : of the model; section, mirror, strides : as asked
    state : just after the event, time 0; it repeats itself up to sides and the way that the walker went. It has the
        gait's values of parameters, so that ``mbd.simulate(model, gait.state)`` walks the gait
    outcome : 'walks', or why there is none, with its time; attempts : what runs beside it came to
    period : of one application of the map [s]; distance : that it leads on [m]
    steps : (foot, time of its touchdown [s], length [m]) in order
    residual : by unit, what the state just after the next event differs by; residuals : largest of each iteration
    stability_of : multipliers, modes, trivial ones; map_derivative : P and how it was found
    parameters : values that differ from the model's, functions of parameters among them
    dt : step [s]; runs : how many were made
    """

    name: str
    section: str
    mirror: tuple[str, str] | None
    strides: int
    state: State
    outcome: Outcome
    attempts: Sequence[Outcome]
    period: float
    distance: float
    steps: tuple[tuple[str, float, float], ...]
    residual: Mapping[str, float]
    residuals: Sequence[float]
    stability_of: Multipliers
    map_derivative: MapDerivative | None
    parameters: Mapping[str, float]
    dt: float
    runs: int
    chart: Chart = field(repr=False)
    map: ReturnMap = field(repr=False)
    way: Vector = field(repr=False)
    given: Any = field(repr=False)

    @cached_property
    def arrival(self) -> Arrival:
        """Where the map leads from its state."""
        return self.map(self.state, self.parameters)

    @property
    def success(self) -> bool:
        """Whether there is a gait."""
        return self.outcome.good

    # the walk -----------------------------------------------------------------------------------------------------
    @property
    def speed(self) -> float:
        """distance/period [m/s]."""
        return self.distance / self.period

    @cached_property
    def turn(self) -> float:
        """By which the walker has turned about the vertical after one application, between −π and π [rad].

        0 where the heading has to come back, and where sides are exchanged, so that the next turn is the opposite one.
        """
        heading = self.chart.section.heading
        if heading is None or self.mirror is not None or not self.success:
            return 0.0
        return -heading.angle(self.state.q, self.run.final.q, self.chart.turning)

    @property
    def step_lengths(self) -> dict[str, float]:
        """Mean length of the steps that each foot ends [m]."""
        return self._by_foot([length for _, _, length in self.steps])

    @property
    def step_times(self) -> dict[str, float]:
        """Mean time of the steps that each foot ends, from the touchdown before, whatever the section [s]."""
        return self._by_foot(list(step_spans(np.array([time for _, time, _ in self.steps]), self.period)))

    def _by_foot(self, values: Sequence[float]) -> dict[str, float]:
        feet = dict.fromkeys(foot for foot, _, _ in self.steps)
        pairs = list(zip(self.steps, values, strict=True))
        return {foot: float(np.mean([value for step, value in pairs if step[0] == foot])) for foot in feet}

    @cached_property
    def run(self) -> Trajectory:
        """The run over one application of the map; of a search that failed, the run from its last state."""
        return self.walk(1)

    def walk(self, count: int = 1) -> Trajectory:
        """The run over so many applications of the map, sides as they come."""
        once = count * self.strides == 1
        until: Any = (self.section, self.map.longest)
        if not once and self.success:
            until = count * self.period * (1.0 + 1e-9)
        return simulate(
            self.map.model, self.state, self.map.integrator, dt=self.dt, until=until, contact="events",
            parameters=self.map.plain(self.parameters), progress=False, on_failure="return", backend=self.map.backend,
        )  # fmt: skip

    def at(self, parameters: Mapping[str, float]) -> LimitCycle:
        """The gait near this one with other values of parameters, or of functions of them.

        Raises
        ------
        ModelError
            for values that are no finite numbers or that the model does not allow, or of one side alone where the gait
            has a mirror; for a gait with neighbours of other energy, none of which was asked for.
        GaitError
            where the walk is lost.
        """
        from mbd.gait.search import on_section, search

        if faults := named_number_faults(parameters, "parameters"):
            raise ModelError(faults)
        parameters = parameters or {}
        values = {**self.parameters, **parameters}
        self.map.require_free(parameters, values)
        self.map.require(values)
        near = on_section(self.chart.section, self.state, self.map.vector(values))
        require_member(self)
        if self.given is None or near is None:
            raise GaitError(f"no gait to go on from: {self.outcome}", self)
        known = None if self.map_derivative is None else self.map_derivative.matrix[: self.chart.size]
        found = search(self.given, near, values, None if known is None else (self.chart, known))
        if not found.success:
            changed = ", ".join(f"{name} = {value:g}" for name, value in parameters.items())
            raise GaitError(f"{self.name} with {changed}: {found.outcome}", found)
        return found

    @cached_property
    def error(self) -> float:
        """Change of the state after one application, and of its period and steps, with half the step dt [SI units]."""
        if not self.success:
            return float("nan")
        zero = np.zeros(self.chart.size)
        here, finer = (
            measured(map_, self.chart, zero, self.parameters) for map_ in (self.map, self.map.with_step(0.5 * self.dt))
        )
        if not isinstance(here, Measured) or not isinstance(finer, Measured) or len(finer.numbers) != len(here.numbers):
            return float("nan")
        return float(np.nanmax(np.abs(finer.numbers - here.numbers)))

    # stability ----------------------------------------------------------------------------------------------------
    @property
    def multipliers(self) -> ComplexArray:
        """Floquet multipliers (k,), complex, by falling modulus; trivial ones stand in `trivial`."""
        return self.stability_of.values

    @property
    def largest_multiplier(self) -> float:
        """The largest modulus: below 1 a small push dies out by this factor each time."""
        return self.stability_of.largest if self.success else float("nan")

    @property
    def stability(self) -> str:
        """'stable', 'unstable', or 'marginal' where the largest modulus is 1 within its error."""
        return self.stability_of.stability if self.success else "none"

    @property
    def trivial(self) -> dict[str, Any]:
        """Multipliers that say nothing about stability, by cause.

        'translation' (1): along the coordinates that the walker moves on along; 'heading' (1): about the vertical,
        where headings are alike; both −1 where the mirror turns them, as to the side of a walker in space; 'time' (0 on
        the section): along the motion; 'energy' (1): where nothing takes any;
        'forgotten' (0): what impacts and resets leave no trace of.
        """
        names = self.chart.section.mechanism.equations.configuration.freedoms
        turned = self.map.turned**self.strides
        along = zip(self.chart.section.fixed, turned, strict=True)
        found: dict[str, Any] = {f"translation {names[k][0]}": float(sign) for k, sign in along}
        if self.chart.section.heading is not None:
            found["heading"] = -1.0 if np.any(turned < 0.0) else 1.0
        return {**found, "time": 0.0, **self.stability_of.trivial}

    @property
    def modes(self) -> list[dict[str, complex]]:
        """For each multiplier its mode, by coordinate and rate: the push that it multiplies.

        Of an orientation small turns about the axes of the child, 'hub.turn.x', as derivatives name them.
        """
        whole = self.chart.basis @ self.stability_of.modes
        return [dict(zip(self._directions, column, strict=False)) for column in whole.T]

    @property
    def _directions(self) -> list[str]:
        equations = self.chart.section.mechanism.equations
        return [*place_names(equations), *equations.velocity_names, *(state.name for state in equations.states)]

    # energy and derivatives ---------------------------------------------------------------------------------------
    @cached_property
    def energy(self) -> dict[str, float]:
        """What each cause gave over one application of the map [J]: gravity, losses, impacts, motors, numerical."""
        return energy_by_cause(self.run)

    @cached_property
    def cost_of_transport(self) -> float:
        """Energy that losses and impacts take, which is what gravity and motors give, over weight and distance [-]."""
        return cost_of_transport(self.energy, self.map.model, self.map.plain(self.parameters), self.distance)

    @property
    def scalars(self) -> dict[str, float]:
        """Every number of the gait that has derivatives by parameters, by name."""
        lengths = {f"step length of {foot}": value for foot, value in self.step_lengths.items()}
        times = {f"step time of {foot}": value for foot, value in self.step_times.items()}
        return {
            "period": self.period, "distance": self.distance, "speed": self.speed, **lengths, **times,
            "largest multiplier": self.largest_multiplier,
        }  # fmt: skip

    @cached_property
    def derivatives(self) -> Derivatives:
        """``gait.derivatives["speed", "gravity.x"]``: of `scalars` by parameters or functions of them."""
        return Derivatives(self)

    # shown --------------------------------------------------------------------------------------------------------
    def facts(self) -> dict[str, str]:
        """What a line or a table shows."""
        if not self.success:
            return {"outcome": f"no gait: {self.outcome}"}
        found = {"period": f"{self.period:.6g} s"}
        for foot, length in self.step_lengths.items():
            if np.isfinite(length):
                found["step" if len(self.step_lengths) == 1 else f"step of {foot}"] = f"{length:.6g} m"
        if np.isfinite(self.distance):
            found["speed"] = f"{self.speed:.5g} m/s"
        if np.isfinite(self.cost_of_transport):
            found["cost of transport"] = f"{self.cost_of_transport:.4g}"
        if "energy" in self.trivial and self.given.member is None:
            found["one of a family, energy"] = f"{energy_of(self.map, [self.state], self.parameters)[0]:.6g} J"
        worst = max(self.residual.values(), default=0.0)
        found["largest multiplier"] = f"{self.largest_multiplier:.6f} ({self.stability}{self._lasting(worst)})"
        found["residual"] = f"{worst:.1g}"
        return found

    def _lasting(self, residual: float) -> str:
        """How long a run stays near an unstable gait, whose residual grows to 1 % by the largest multiplier."""
        if self.stability != "unstable":
            return ""
        count = np.log(0.01 / max(residual, 1e-15)) / np.log(self.largest_multiplier)
        return f": a run from its state leaves it after about {max(1, round(float(count)))} applications of the map"

    def __repr__(self) -> str:
        return f"{self.name}: " + ", ".join(
            text if name == "outcome" else f"{name} {text}" for name, text in self.facts().items()
        )

    def _repr_html_(self) -> str:
        rows: list[tuple[str, str]] = list(self.facts().items())
        rows += [(f"multiplier {k}", _complex(value)) for k, value in enumerate(self.multipliers, start=1)]
        rows += [(f"energy from {cause}", f"{value:.5g} J") for cause, value in self.energy.items() if self.success]
        return table(f"gait of {self.name}", ("", "value"), rows)

    def plot(self, path: str | Path | None = None) -> Figure:
        """The cycle in the phase plane of each angle, and the multipliers beside the unit circle; the figure."""
        figure: Figure = later("LimitCycle.plot")(self, path)
        return figure


def _complex(value: complex) -> str:
    sign = "+" if value.imag > 0.0 else "−"
    return f"{value.real:.8g}" + (f" {sign} {abs(value.imag):.8g}i" if value.imag else "")


def residual_by_unit(chart: Chart, c: Vector) -> dict[str, float]:
    """The largest difference of each unit that the coordinates c of a chart stand for."""
    equations = chart.section.mechanism.equations
    units = [unit for _, unit in equations.configuration.freedoms] + list(equations.configuration.velocity_units)
    units += [state.unit or "1" for state in equations.states]
    units += ["m/s"] * (len(chart.basis) - len(units))
    found: dict[str, float] = {}
    for unit, value in zip(units, np.abs(chart.basis @ c), strict=True):
        found[unit] = max(found.get(unit, 0.0), float(value))
    return found


def energy_by_cause(run: Trajectory) -> dict[str, float]:
    """What each cause gave from the first row to the last [J]; negative: it took. Gravity and springs give what they
    had stored; NaN of a kind with a part that is withheld.
    """
    ledger = run.energy
    kinds, withheld = ledger.by_kind(), {part.kind for part in ledger.parts if part.withheld}
    stored = titled(ledger.stored, kinds)
    given = {title: float(energy[0] - energy[-1]) for title, energy in stored.items() if len(energy)}
    taken = {kind: float(values[-1]) for kind, values in kinds.items() if len(values)}
    return {**given, **taken, **dict.fromkeys(withheld, float("nan"))}


def cost_of_transport(energy: Mapping[str, float], model: Any, changed: Mapping[str, float], distance: float) -> float:
    """``−Σ (losses, dampers, friction, penalties, impacts) / (m g d)`` [-]; NaN without bodies, gravity or a way, and
    where one of these is not known.
    """
    values = {**getattr(model, "parameters", {}), **changed}
    mass = sum(values.get(f"{body}.mass", 0.0) for body in getattr(model, "bodies", {}))
    gravity = float(np.linalg.norm([values.get(f"gravity.{axis}", 0.0) for axis in "xyz"]))
    weight = mass * gravity * abs(distance)
    taken = -sum(value for kind, value in energy.items() if kind in SPENT)
    return taken / weight if weight > 0.0 else float("nan")
