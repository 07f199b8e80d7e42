"""What controllers and resets change during a run, judged as what a model is described with and a run starts from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.assembly.assemble import undetermined
from mbd.assembly.consistency import residuals, violations
from mbd.assembly.posture import Posture
from mbd.assembly.trivial_rows import trivial_rows
from mbd.bodies.domains import ParameterCheck
from mbd.compile.mechanism import Mechanism
from mbd.errors import ModelError
from mbd.tape.derivatives import live
from mbd.tape.node import Node

if TYPE_CHECKING:
    from mbd.simulation.run.run import Run

__all__ = ["ParameterJudge", "residuals_now", "violations_now"]


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
        return self._in([self._mechanism.equations.kinetic])

    @cached_property
    def _binding(self) -> frozenset[str]:
        """Names of the parameters on which rows depend."""
        return self._in([node for row in self._mechanism.equations.rows for node in (row.value, row.rate)])

    def _in(self, nodes: Sequence[Node]) -> frozenset[str]:
        """Names of the parameters in some expressions."""
        places = {n.data[1] for n in live(nodes) if n.op == "input" and n.data[0] == "p"}
        return frozenset(p.name for k, p in enumerate(self._mechanism.equations.parameters) if k in places)

    def faults(self, run: Run, values: Mapping[str, float]) -> list[str]:
        """One sentence for each; of the state only what the values may have changed is looked at."""
        changed = {**run.changed, **values}
        found = self._check.faults(changed, values)
        if found or (self._inert.isdisjoint(values) and self._binding.isdisjoint(values)):
            return found
        parameters = self._mechanism.parameters(changed, self._model.parameters)
        if not self._inert.isdisjoint(values):
            v = run.values
            q, y, anchors = v["q"][: v["n_q"]].copy(), v["y"][: v["n"]].copy(), np.array(v["anchors"])
            flags = v["closed"][: v["n_contacts"]]
            found = undetermined(Posture(self._mechanism, run.manager, parameters, q, y, flags, anchors, time=run.now))
        if not found and not self._binding.isdisjoint(values):
            found = violations_now(run, residuals_now(run, parameters), residuals_now(run)[:2])
            found = found or self._trivial(run, parameters)
        return found

    def _trivial(self, run: Run, parameters: Vector) -> list[str]:
        """Rows that held whatever the motion and do not with these values, or the other way round."""
        try:
            changed = sorted(trivial_rows(self._mechanism, parameters) ^ run.manager.trivial)
        except ModelError as error:
            return [str(error)]
        rows = self._mechanism.equations.rows
        return [
            f"{rows[k].title} {'no longer holds' if k in run.manager.trivial else 'now holds'} whatever the motion: "
            "the mechanism is another; start a run with these values"
            for k in changed
        ]


def residuals_now(run: Run, parameters: Vector | None = None) -> NDArray[np.float64]:
    """Residuals (`mbd.assembly.consistency`) of the accepted state, with other values of parameters if given."""
    v = run.values
    q, y, anchors = v["q"][: v["n_q"]], v["y"][: v["n"]], v["anchors"][: v["n_anchors"]]
    return residuals(run.mechanism, run.now, q, y, v["params"] if parameters is None else parameters, anchors)


def violations_now(run: Run, found: NDArray[np.float64], usual: NDArray[np.float64] | None = None) -> list[str]:
    """`mbd.assembly.consistency.violations` of the rows that are active now."""
    v = run.values
    active = run.manager.active_rows(v["closed"][: v["n_contacts"]])
    speed = float(np.max(np.abs(v["y"][: v["n_v"]]), initial=0.0))
    return violations(run.mechanism.equations.rows, active, found, speed, usual)
