"""The active set of a mechanism, without the rows that hold whatever the motion."""

from dataclasses import dataclass

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.compile.trivial_rows import trivial_rows
from mbd.kernel.contact.active_set import ActiveSetManager


@dataclass
class _Last:
    """The manager that served last."""

    manager: ActiveSetManager | None = None


def manager_of(mechanism: Mechanism, parameters: Vector) -> ActiveSetManager:
    """The active set of a mechanism in which the rows that are trivial with these parameters never act.

    Raises
    ------
    ModelError
        see `trivial_rows`.
    """
    trivial = trivial_rows(mechanism, parameters)
    last = mechanism.kept(_Last, _Last)
    if last.manager is None or last.manager.trivial != trivial:
        last.manager = ActiveSetManager(mechanism.equations, trivial)
    return last.manager
