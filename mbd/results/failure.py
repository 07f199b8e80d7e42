"""The step at which a run failed, with everything needed to repeat it."""

from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

from mbd.dataclass import dataclass
from mbd.results.record import EventRecord
from mbd.state import State


@dataclass(frozen=True, eq=False)
class Failure:
    """Why a run could not go on, and from where the failing step can be repeated by `mbd.replay`.

    Attributes
    ----------
    message : the sentence of the error
    time : of the last accepted state [s]
    attempted : the instant that could not be reached [s]; `time` where nothing was tried
    state : the last accepted state with its memory; positions, multipliers, contacts, all as before the failing step
    candidate : what the step had come to when it was given up; it may hold values that are not finite
    residuals : of the balance and of the rows at the candidate, by name [N, N m, m, rad, m/s, rad/s]
    residual : the largest of them over its tolerance at the last iteration, 0 where nothing was iterated
    iterations : Newton corrections of the failing step, those of its shortened tries included
    dt, integrator, settings : how the run was made
    parameters : values that differ from the model's
    events : the last ones before the failing step
    undone : those of the failing step itself, which were taken back with it
    model : what was simulated; None where a file does not hold it
    """

    message: str
    time: float
    attempted: float
    state: State
    candidate: State
    residuals: Mapping[str, float]
    residual: float
    iterations: int
    dt: float
    integrator: Any
    settings: Mapping[str, Any]
    parameters: Mapping[str, float] = field(default_factory=dict)
    events: Sequence[EventRecord] = ()
    undone: Sequence[EventRecord] = ()
    model: Any = None

    def save(self, path: str | Path) -> Path:
        """Write it as one file for `mbd.replay`, ``.failure.npz`` if the path has no extension.

        Numbers and words as in the file of a run. The model is pickled beside them, where it can be: then only open
        such a file if you trust where it comes from, or give `mbd.replay` the model, which leaves the pickle unread.
        """
        from mbd.results.capsule import save

        return save(self, path)

    def __repr__(self) -> str:
        worst = sorted(self.residuals.items(), key=lambda item: -abs(item[1]))[:3]
        where = f"after t = {self.time:.9g} s, of the step to {self.attempted:.9g} s"
        if self.attempted <= self.time:
            where = f"of the run to t = {self.time:.9g} s"
        lines = [f"Failure {where}: {self.message}"]
        tol = self.settings.get("tol")
        steps = f"dt = {self.dt:g} s" if tol is None else f"tol = {tol:g}"
        lines.append(f"  {self.integrator!r}, {steps}, {self.iterations} Newton corrections")
        lines += [f"  residual of {name}: {value:.3g}" for name, value in worst]
        lines += [f"  {event!r}" for event in self.events]
        lines += [f"  taken back: {event!r}" for event in self.undone]
        return "\n".join(lines)
