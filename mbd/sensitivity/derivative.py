"""Derivatives of the state and instant at which a run ended."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.results.trajectory import Trajectory
from mbd.sensitivity.made_run import MadeRun
from mbd.sensitivity.passed import Passed
from mbd.sensitivity.passing import tangent_run
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, Source
from mbd.sensitivity.starts import Direction, directions, programs_of, restitutions_of, start_tangent


def final_state_derivative(
    run: Trajectory, wrt: Sequence[str | tuple[str, Mapping[str, float]]], held: Collection[str] = ()
) -> tuple[Matrix, Vector]:
    """d(q, v) at the end of a run, and d t_end, by coordinates and speeds of its start and by parameters.

    The run is made once more with derivatives, which takes as long as two to four runs, and not longer for twenty
    directions than for one. So a Newton iteration on a map of a run, such as a return map, asks once for all
    of its unknowns: ``run = mbd.simulate(…, until="right foot")``, ``final_state_derivative(run, names, held=names)``.

    Parameters
    ----------
    run : as `mbd.simulate` returned it
    wrt : D names of coordinates and rates of the start ('hip.angle', 'hip.rate') and of parameters; or pairs of a name
        and the rates of several parameters by it, ``("slope", {"gravity.x": 9.8, "gravity.y": 0.5})``
    held : names of coordinates and rates of the start that stay as they are as others complete it; none: a change of
        the start is projected onto the rows that hold, and one that lies in them is taken as it is

    Returns
    -------
    (n_v + n_v, D), (D,)
        of the configuration along velocities, which are those of coordinates where these add, and of an orientation a
        small rotation vector in the child's axes; then of velocities. Total derivatives: those of the state by its own
        instant are part of the first, where an event ends the run

    Raises
    ------
    UnknownNameError
        for a name that is none of these.
    CapabilityError
        where the run has no derivative, or none that the pass knows, by name and time.
    """
    return end_of(passed(run, wrt, held)[0])


@dataclass(frozen=True)
class Differentiated:
    """The pass over a run with what it was made of."""

    rows: RunRows
    programs: Programs
    walked: Passed


def end_of(found: Differentiated) -> tuple[Matrix, Vector]:
    """d(q, v) and dt at the end of a run."""
    tangent = found.walked.motion.tangent
    n_v = len(tangent.q)
    return np.vstack([tangent.q, tangent.y[:n_v]]), tangent.t


def passed(
    run: Trajectory, wrt: Sequence[str | tuple[str, Mapping[str, float]]], held: Collection[str] = (),
    source: Source | None = None, made: Any = None,
) -> tuple[Differentiated, Sequence[Direction]]:  # fmt: skip
    """The pass over a run, and its directions.

    The run is made once more, to the bit, by the kernel with derivatives (`mbd.sensitivity.tangent`), unless it carried
    them itself.

    source : what made the run, where that is known; made : itself
    """
    rows = RunRows(run, source)
    if isinstance(made, MadeRun) and made.ready is not None:
        wanted, programs, start = made.ready.wanted, made.ready.programs, made.ready.start
        walked = tangent_run(rows, programs, start, restitutions_of(wanted), made=made)
        return Differentiated(rows, programs, walked), wanted
    wanted = directions(rows.mechanism, wrt)
    programs = programs_of(rows.mechanism, wanted, rows.record.parameters)
    start, restitutions = start_tangent(rows.first, programs, wanted, held), restitutions_of(wanted)
    return Differentiated(rows, programs, tangent_run(rows, programs, start, restitutions)), wanted
