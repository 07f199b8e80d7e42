"""Net moments of joints: all that acts along a joint's coordinate but gravity and the ground."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from mbd.arrays import Vector

if TYPE_CHECKING:
    from mbd.results.columns import ModelColumns
    from mbd.results.trajectory import Trajectory
    from mbd.tape.node import Node

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
        known = [name for name in coordinates if self._columns.knows(f"{name}.net_moment")]
        self._nodes = {name: self._columns.node(f"{name}.net_moment") for name in known}

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
