"""A run that carries its derivatives as it is made, so that it need not be made a second time for them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np

from mbd.assembly.machines import is_end
from mbd.dataclass import dataclass
from mbd.equations.switching_times import switches_of
from mbd.integrators.stepping import own_scheme
from mbd.kernel import codes
from mbd.kernel.schemes.contract import NO_SCHEME
from mbd.sensitivity.motion import First, Tangent
from mbd.sensitivity.passing import Charted, seed
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import held_at, mode_of
from mbd.sensitivity.starts import Direction, directions, programs_of, restitutions_of, start_tangent
from mbd.sensitivity.tangent_run import DIRECTIONS, TangentRun
from mbd.simulation.marching import Run
from mbd.simulation.run.ends import call
from mbd.simulation.run.savepoints import restore, save
from mbd.simulation.run.stored import columns_of

Ways = Callable[[Mapping[str, float]], tuple[Sequence[Any], Sequence[str]]]
"""Directions, and names of the start that stay, by the parameters of a run."""


@dataclass(frozen=True)
class Ready:
    """What a run is differentiated by, and the derivatives of its start."""

    wanted: Sequence[Direction]
    programs: Programs
    start: Tangent


class MadeRun(TangentRun):
    """A run that is asked for with derivatives.

    ready : what it carries; None where its first row does not come at once, so that it has to be made again
    """

    repeats = False
    rows_at_once = 512  # of which few have derivatives
    ways: Ways
    ready: Ready | None = None

    def at_start(self) -> Self:
        """The same; what rows hold at the first instant, which derivatives of the start follow, is found and undone."""
        mechanism, values = self.mechanism, self.first_parameters
        names = (parameter.name for parameter in mechanism.equations.parameters)
        ways, held = self.ways(dict(zip(names, values, strict=False)))
        wanted = directions(mechanism, ways)
        programs = programs_of(mechanism, wanted, values)
        self.moved_with_jump = lambda: None
        self.begin_tangents(programs.directed)
        super().at_start()
        point, self.stepper.follows = save(self), False
        status, self.stepper.follows = call(self, self.now, np.inf), True
        if status == codes.DONE and self.kernel.n_stored:
            self.collect()
            first = self.first
            self.ready = Ready(wanted, programs, start_tangent(first, programs, wanted, held))
        restore(self, point)
        self.history, self.of_times, self.of_rows = [], [], {}
        if self.ready is not None:
            some = slice(0, min(len(wanted), DIRECTIONS))
            seed(self, Charted(programs), first.q, self.ready.start, restitutions_of(wanted), some)
        return self

    @property
    def first(self) -> First:
        """The first row, which is there."""
        row = {name: part[0] for name, part in columns_of(self, self.table[:1]).items()}
        mode = mode_of(self.manager, row["closed"].astype(np.uint8), row["phase"].astype(np.int8))
        y = np.concatenate([row["v"], row["z"]])
        return First(
            float(row["time"]), row["q"].copy(), y, held_at(self.start, self.mechanism), mode, is_end(self.start)
        )


def made_with(ways: Ways, *given: Any) -> Run:
    """A run with derivatives as it is made, or one without where what happens between its steps stands in its way.

    That is: controllers, resets, forces that jump in time, trial runs to a tolerance, and schemes in Python alone.
    """
    model, mechanism, manager, scheme, own = *given[:4], given[9]
    reacts = getattr(model, "controllers", ()) or any(guard.reset is not None for guard in manager.guards)
    if reacts or "allowed" in own or own["locate"] != "root" or own_scheme(scheme) is NO_SCHEME:
        return Run(*given)
    if switches_of(mechanism.equations):
        return Run(*given)
    run = MadeRun(*given)
    run.ways = ways
    return run
