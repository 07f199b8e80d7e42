"""Values that a controller writes during a run, judged as those that a model is described with."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.assembly import undetermined
from mbd.bodies.domains import ParameterCheck
from mbd.compile.mechanism import Mechanism
from mbd.posture import Posture
from mbd.tape.derivatives import live

if TYPE_CHECKING:
    from mbd.simulation.run import Run

__all__ = ["ParameterJudge"]


class ParameterJudge:
    """What is wrong with new values of parameters at the present state of a run.

    Parameters
    ----------
    model, mechanism : those of the run
    """

    def __init__(self, model: Any, mechanism: Mechanism) -> None:
        self._model, self._mechanism = model, mechanism

    @cached_property
    def _check(self) -> ParameterCheck:
        check: ParameterCheck = self._model.parameter_check()
        return check

    @cached_property
    def _inert(self) -> frozenset[str]:
        """Names of the parameters on which the kinetic energy, and with it the mass matrix, depends."""
        equations = self._mechanism.equations
        places = {n.data[1] for n in live([equations.kinetic]) if n.op == "input" and n.data[0] == "p"}
        return frozenset(p.name for k, p in enumerate(equations.parameters) if k in places)

    def faults(self, run: Run, values: Mapping[str, float]) -> list[str]:
        """One sentence for each; of the state only what the values may have changed is looked at."""
        changed = {**run.changed, **values}
        found = self._check.faults(changed, values)
        if found or self._inert.isdisjoint(values):
            return found
        v = run.values
        parameters = self._mechanism.parameters(changed, getattr(self._model, "parameters", {}))
        q, y, anchors = v["q"][: v["n_q"]].copy(), v["y"][: v["n"]].copy(), np.array(v["anchors"])
        flags = v["closed"][: v["n_contacts"]]
        return undetermined(Posture(self._mechanism, run.manager, parameters, q, y, flags, anchors, time=run.now))
