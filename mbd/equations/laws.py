"""The constraints of a model as expressions, while they are gathered."""

from collections.abc import Sequence
from dataclasses import field

from mbd.dataclass import dataclass
from mbd.equations.equations import Contact, Effect, Friction, Guard, Machine, Row, StrikeImpulse
from mbd.tape.node import Node, Scalar


@dataclass
class Laws:
    """The constraints of a model as expressions; `faults` tells what cannot hold.

    viewed : the values of `rows`, the rates of those on velocities, in views
    penalties : (number, gap, force) of penalty contacts in views
    drags : (number, velocity, force) of their forces along velocities in views
    sliding : the sliding velocities of `frictions` in views
    idle : (owner, part) of rows of cut joints that hold by themselves
    rates : (z, ż) of the first-order states of laws
    """

    rows: list[Row] = field(default_factory=list)
    viewed: list[Node] = field(default_factory=list)
    penalties: list[tuple[int, Node, Node]] = field(default_factory=list)
    drags: list[tuple[int, Node, Node]] = field(default_factory=list)
    contacts: list[Contact] = field(default_factory=list)
    guards: list[Guard] = field(default_factory=list)
    frictions: list[Friction] = field(default_factory=list)
    sliding: list[Node] = field(default_factory=list)
    effects: list[Effect] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    idle: list[tuple[str, str]] = field(default_factory=list)
    rates: list[tuple[Node, Scalar]] = field(default_factory=list)
    machines: list[Machine] = field(default_factory=list)
    impulses: list[StrikeImpulse] = field(default_factory=list)

    def take_machines(self, machines: Sequence[Machine], guards: Sequence[Guard]) -> None:
        """Add machines, and their transitions behind users' events."""
        self.machines += machines
        self.guards += guards
