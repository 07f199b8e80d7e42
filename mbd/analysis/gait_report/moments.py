"""Net moments of joints: all that acts along a joint's coordinate but gravity and the ground."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from mbd.arrays import Vector
from mbd.tape.derivatives import gradient

if TYPE_CHECKING:
    from mbd.equations.equations import Equations
    from mbd.results.columns import ModelColumns
    from mbd.tape.node import Node
    from mbd.trajectory import Trajectory

__all__ = ["Moments"]


class Moments:
    """``τ_k = −Σ f_k − Σ λ ∂h/∂q_k`` over losses, springs, motors, stops and locks: what muscles would do in a body.

    This is what inverse dynamics finds from motion and ground reaction. Impacts, whose moments are without bound, are
    not in it. Joints that close a loop have no coordinate, and so no moment here.

    Parameters
    ----------
    run : a trajectory with its model
    coordinates : names of the joints' coordinates, such as 'left knee.angle'
    """

    def __init__(self, run: Trajectory, coordinates: Sequence[str]) -> None:
        self._columns: ModelColumns | None = run.columns.between_rows
        self._nodes: dict[str, Node] = {}
        if self._columns is None:
            return
        equations = self._columns.equations
        names = [name for name, _ in equations.configuration.freedoms]
        wanted = {name: names.index(name) for name in coordinates if name in names}
        ground = {contact.name for contact in run.facts.contacts if contact.place}
        with equations.tape.lock:
            self._nodes = _moments(equations, wanted, ground)

    @property
    def known(self) -> tuple[str, ...]:
        """The coordinates that have one."""
        return tuple(self._nodes)

    def at(self, run: Trajectory, times: Vector) -> Mapping[str, Vector]:
        """τ at some times, just after events [N m]."""
        if self._columns is None or not self._nodes:
            return {}
        columns = self._columns
        rows = columns.between(columns.grid.places(times, "right"))
        return dict(zip(self._nodes, columns.evaluate(list(self._nodes.values()), rows), strict=True))


def _moments(equations: Equations, wanted: Mapping[str, int], ground: set[str]) -> dict[str, Node]:
    """The moments as nodes of the tape."""
    tape = equations.tape
    total = dict.fromkeys(wanted, tape.zero)
    dry = {f"{friction.name} friction" for friction in equations.frictions}
    for effect in equations.effects:
        of_ground = effect.contact >= 0 and equations.contacts[effect.contact].name in ground
        if effect.kind == "gravity" or of_ground or effect.name in dry:
            continue
        switch = tape.one if effect.contact < 0 else tape.input("switch", effect.contact)
        forces = effect.generalized()
        for name, place in wanted.items():
            total[name] = total[name] - switch * forces[place]
    x, v = ([tape.input(kind, k) for k in wanted.values()] for kind in ("x", "v"))
    for number, row in enumerate(equations.rows):
        if row.contact >= 0 and equations.contacts[row.contact].name in ground:
            continue
        slopes = gradient(row.rate, v) if row.is_velocity else gradient(row.value, x)
        for name, slope in zip(wanted, slopes, strict=True):
            if not slope.is_zero:
                total[name] = total[name] - tape.input("lam", number) * slope
    return total
