"""The study of effects: the whole scene, the scene without each of them, and without all that may go."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from itertools import zip_longest
from typing import Any

import numpy as np

from mbd.analysis.accuracy.compare import ranges
from mbd.analysis.effects.comparison import change
from mbd.analysis.effects.contribution import Change, Contribution, Together
from mbd.analysis.effects.result import Effects
from mbd.analysis.effects.scenes import Element, Scene, elements, reduced
from mbd.analysis.effects.timing import Pair, Timing, timed
from mbd.analysis.wanted import names_wanted, scalars_wanted
from mbd.bodies.values import is_number, shown
from mbd.compile.mechanisms import mechanism_of
from mbd.equations.cost import cost
from mbd.equations.derivation import FrontDoor
from mbd.errors import MbdError, ModelError, SimulationError
from mbd.integrators import Integrator
from mbd.progress import Progress, share_bar
from mbd.results.ledger import Ledger
from mbd.results.trajectory import Trajectory
from mbd.simulation.interrupted import stopped
from mbd.simulation.run.memory import without_memory
from mbd.simulation.simulate import simulate
from mbd.state import State
from mbd.topology.description import Description

EACH, STEPS = 0.25, (500, 20000)
"""A timed run takes about this long [s], but has at least and at most so many steps."""
OPTIONS = ("contact", "impact", "locate", "parameters", "rest_speed", "backend")


def effects(
    model: Any,
    start: State,
    until: float | str | tuple[str, float],
    integrator: Integrator | None = None,
    dt: float = 1e-3,
    outputs: Sequence[str] | str | None = None,
    tolerance: float = 1e-3,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Effects:
    """Measure what each effect of a scene costs and changes, and say which may be left out.

    Every effect that ``model.cost()`` lists is left out in turn (`Model.without`), and the scene is run again from the
    same positions and velocities. Those whose absence changes no output by more than the tolerance are then left out
    together; where that changes more, the one that changes most alone is put back, until a run holds.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    start : from `mbd.assemble`
    until : end time [s], or the event that ends the run, or (event, latest time)
    integrator : default ``HHT(alpha=0.05)``
    dt : step [s]
    outputs : names of results to judge by; default all coordinates, of joints that are cut their own
    tolerance : change that is allowed, relative to the range of an output in the whole scene [-]
    progress : True for a bar on a terminal, or ``progress(done, total)``
    options : those of `mbd.simulate`: contact, impact, locate, parameters, rest_speed, backend

    Returns
    -------
    Effects
        with what was found until then if it was interrupted (Ctrl-C).

    Raises
    ------
    ModelError, UnknownNameError
        for a tolerance that is not positive, outputs that do not exist, a model without effects.
    SimulationError
        if the whole scene fails.
    """
    _check(model, start, tolerance, outputs, options)
    with share_bar() if progress is True else nullcontext(progress or None) as report:
        bench = Bench(model, start, until, integrator, dt, options, report)
        bench.begin(outputs)
        return bench.study(tolerance)


class Bench:
    """Where the runs of one study are made."""

    def __init__(
        self, model: Any, start: State, until: Any, integrator: Integrator | None, dt: float,
        options: Mapping[str, Any], report: Progress | None,
    ) -> None:  # fmt: skip
        self.until, self.integrator, self.dt, self.report = until, integrator, dt, report
        self.backend = options.get("backend", "auto")
        self.options = {name: value for name, value in options.items() if name != "parameters"}
        parameters = {**start.parameters, **(options.get("parameters") or {})}
        self.scene = Scene(model, without_memory(start), parameters)
        self.cost = cost(model)
        equations = mechanism_of(model, self.backend, parameters).equations
        self.elements = elements(equations, self.cost)
        if not self.elements:
            raise ModelError(
                f"{self.cost.name!r} has no effects: no gravity, loss, spring, force, penalty contact or dry friction"
            )

    def begin(self, outputs: Any) -> None:
        """The run of the whole scene, and what to judge by."""
        self.whole = self.run(self.scene)
        if not self.whole.success:
            raise SimulationError(f"the whole scene fails: {self.whole.message}", self.whole)
        if not self.whole.time[-1] > self.whole.time[0]:
            raise ModelError(f"until must be after the start at {self.whole.time[0]:g} s, not {self.until!r}")
        self.outputs = _outputs(self.scene.model, self.whole, outputs)
        self.instants = np.linspace(float(self.whole.time[0]), float(self.whole.time[-1]), 4001)
        self.scales = ranges(self.whole, self.outputs, self.instants)
        if isinstance(self.until, str):  # without an effect it may never happen
            begin, end = float(self.whole.time[0]), float(self.whole.time[-1])
            # a scene whose end is an event is waited for this much longer without an effect
            self.until = (self.until, begin + 2.0 * (end - begin))
        again = self.run(self.scene).stats  # all code has been made
        self.steps = int(np.clip(EACH * again["steps"] / again["wall_seconds"], *STEPS))

    def run(self, scene: Scene, until: Any = None, dt: float | None = None) -> Trajectory:
        """One run of a scene, to the end or to another; an interruption ends the study."""
        found = simulate(
            scene.model, scene.start, self.integrator, dt or self.dt, until=self.until if until is None else until,
            parameters=scene.parameters, on_failure="return", **self.options,
        )  # fmt: skip
        if stopped(found):
            raise KeyboardInterrupt
        return found

    def share(self, place: float, size: float = 1.0) -> Callable[[float], None]:
        """Progress of a part of all."""
        report, total = self.report, 2.0 * len(self.elements) + 1.0
        return (lambda part: None) if report is None else lambda part: report(min(place + size * part, total), total)

    def without(self, names: Iterable[str]) -> tuple[Scene | None, Change]:
        """The scene without some effects, and what that changes."""
        names = tuple(names)
        try:
            scene = reduced(self.scene, self.whole, names, self.backend)
            return scene, change(self.run(scene), self.whole, self.scales, self.instants)
        except MbdError as error:
            return None, Change(failure=str(error))

    def study(self, tolerance: float) -> Effects:
        """Every effect alone, their times, and all together that may go; what is known if it is interrupted."""
        found: list[tuple[Element, Scene | None, Change]] = []
        times: list[Timing | None] = []
        together, complete = None, True
        try:
            for place, element in enumerate(self.elements):
                self.share(place)(0.0)
                found.append((element, *self.without([element.name])))
            times = timed([self._pair(scene, change) for _, scene, change in found], self.share(len(found), len(found)))
            together = self._together([(element.name, change) for element, _, change in found], tolerance)
            self.share(2.0 * len(self.elements) + 1.0)(0.0)
        except KeyboardInterrupt:
            complete = False
        energies = _energies(self.whole.energy)
        known = zip_longest(found, times)
        contributions = tuple(
            _contribution(element, change, energies, timing) for (element, _, change), timing in known
        )
        return Effects(
            self.cost.name, self.outputs, tolerance, contributions, self.cost.newton, self._shared(), together,
            self.whole, complete,
        )  # fmt: skip

    def _pair(self, scene: Scene | None, change: Change) -> Pair | None:
        """Runs of the whole scene and of one without an effect over the stretch in which their events are the same.

        The step is shortened where that stretch has few steps, so that what comes before the first does not count.
        """
        if scene is None:
            return None
        begin, end = float(self.whole.time[0]), float(self.whole.time[-1])
        until = min(begin + 0.999 * (min(end, change.until) - begin), begin + self.steps * self.dt)
        if until - begin < 2.0 * self.dt:
            return None
        dt = min(self.dt, (until - begin) / self.steps)
        return lambda: self.run(self.scene, until, dt), lambda: self.run(scene, until, dt)

    def _together(self, singles: Sequence[tuple[str, Change]], tolerance: float) -> Together | None:
        """All effects that may go alone, left out at once; those that change most put back until a run holds."""
        able = sorted((c.largest, name) for name, c in singles if c.within(tolerance))
        names: list[str] = [name for _, name in able]
        back: list[str] = []
        while names:
            found = dict(singles)[names[0]] if len(names) == 1 else self.without(names)[1]
            if found.within(tolerance):
                return Together(tuple(names), tuple(back), found, self._operations(names))
            back.append(names.pop())
        return None

    def _operations(self, names: Sequence[str]) -> int:
        """Operations of a Newton iteration, index 3, with no contact closed, without some effects."""
        return cost(self.scene.model.without(*names)).newton

    def _shared(self) -> int:
        """Operations that only effects need, and several of them: counted for none."""
        always = [element for element in self.elements if element.acts == "always"]
        bare = self._operations([element.name for element in always])
        return self.cost.newton - bare - sum(element.operations for element in always)


def _contribution(
    element: Element, change: Change, energies: Mapping[str, float], timing: Timing | None
) -> Contribution:
    energy = energies.get(element.name, 0.0)
    if element.name.endswith(" loss"):
        energy += energies.get(f"{element.name.removesuffix(' loss')} friction", 0.0)
    total = sum(energies.values())
    return Contribution(
        element.name, element.kind, element.operations, element.acts, timing, energy,
        energy / total if total > 0.0 else 0.0, change,
    )  # fmt: skip


def _energies(ledger: Ledger) -> dict[str, float]:
    """What went through each element of the ledger [J]: a bushing's springs and dampers together."""
    found: dict[str, float] = {}
    for part in (*ledger.parts, *ledger.stored):
        if not part.withheld:
            found[part.name] = found.get(part.name, 0.0) + part.passed
    return found


def _check(model: Any, start: Any, tolerance: Any, outputs: Any, options: Mapping[str, Any]) -> None:
    """Faults of the arguments that the runs do not check, all at once."""
    faults = [] if isinstance(start, State) else [f"start must be a State from mbd.assemble(model, …), not {start!r}"]
    if not isinstance(model, Description | FrontDoor):
        faults.append(f"model must be an mbd.Model or mbd.Lagrangian, not {shown(model)}")
    faults += [] if outputs is None else names_wanted(outputs, "outputs")[1]
    if not is_number(tolerance) or not math.isfinite(tolerance) or tolerance <= 0.0:
        faults.append(f"tolerance must be a positive part of an output's range such as 1e-3, not {tolerance!r}")
    faults += [f"effects() has no option {name!r}; it has {', '.join(OPTIONS)}" for name in options
               if name not in OPTIONS]  # fmt: skip
    if faults:
        raise ModelError(faults)


def _outputs(model: Any, run: Trajectory, wanted: Any) -> tuple[str, ...]:
    """Scalars behind the names; every wrong name with the nearest."""
    if wanted is None:
        names = [name for name, _ in run.facts.coordinates]
        own = [name for joint in getattr(model, "joints", ()) for name in joint.coordinate_names]
        if own and not {*names} <= {*own}:  # without the friction that cuts a joint, bodies float no more
            names = own
        return tuple(names)
    return scalars_wanted(run, wanted, "outputs", "output")
