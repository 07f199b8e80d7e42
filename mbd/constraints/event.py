"""A user's own event."""

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any

from mbd.bodies.domains import Domain
from mbd.bodies.promises import function_of
from mbd.bodies.scope import Scope
from mbd.bodies.values import among, flag, name_of, names_of
from mbd.constraints.expressions import is_expression, plain
from mbd.constraints.machine import Change, Machine
from mbd.constraints.measure import Measure
from mbd.constraints.user_measure import measured
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.quantities import Mention
from mbd.tape.node import Node, Scalar


@dataclass(frozen=True)
class Event(Machine):
    """Something that happens as a measure crosses zero, or with something else.

    Parameters
    ----------
    name : its name, under which it stands in the run
    guard : what crosses zero as it happens: a measure, the name of a quantity ('trunk.y.rate'), a function of named
        quantities, an expression; None: it happens `on` something
    reset : named values to set, {'hip.rate': 0.0}, or a function that makes them from named values; None for no change.
        A value may be a function of named values, ``{'hip.rate': lambda named: -0.5 * named['hip.rate']}``, or a sympy
        expression: ``{theta.q: -theta.q, phi.v: 0}``
    terminal : whether the run ends there
    direction : −1 as the guard falls through zero, +1 as it rises, 0 both. A value that jumps over zero, as the rate of
        a knee in an impact or at a reset, has crossed it then
    on : name of what it happens with, in the place of a guard: a contact that closes ('left foot'), after its impact,
        or opens ('left foot opened'), another event, a mode that changes or enters a state ('gait: swing')
    """

    name: str
    guard: Any = None
    reset: Any = field(default=None, hash=False)
    terminal: bool = False
    direction: int = 0
    on: str | None = None

    state_names = ("waiting",)
    fields = ("index",)
    quantity_names = ()

    def __post_init__(self) -> None:
        name_of(self.name, "Event")
        if (self.guard is None) == (self.on is None):
            raise ModelError(f"Event '{self.name}' takes one cause, a guard or on=, such as on='left foot'")
        if self.on is not None and (not isinstance(self.on, str) or not self.on or self.on == self.name):
            raise ModelError(f"on of Event '{self.name}' is the name of something else that happens, got {self.on!r}")
        if self.on is not None and self.direction:
            raise ModelError(f"direction of Event '{self.name}' is that of a guard; leave it out beside on=")
        if self.guard is not None:
            object.__setattr__(self, "guard", measured(self.guard, f"guard of Event '{self.name}'"))
        if not (self.reset is None or isinstance(self.reset, Mapping) or callable(self.reset)):
            raise ModelError(f"reset of Event '{self.name}' maps names to values, got {self.reset!r}")
        if isinstance(self.reset, Mapping):
            named = {str(key) if is_expression(key) else key: plain(value) for key, value in self.reset.items()}
            object.__setattr__(self, "reset", named)
            names_of(self.reset, f"each key of the reset of Event '{self.name}'")
        for value in self.reset.values() if isinstance(self.reset, Mapping) else (self.reset,):
            if isinstance(value, Measure):
                raise ModelError(
                    f"reset of Event '{self.name}' is given by a measure; give a number, or a function of the named "
                    "values, such as {'hip.rate': lambda named: -0.5 * named['hip.rate']}"
                )
            if callable(value) and not is_expression(value):
                function_of(value, f"reset of Event '{self.name}'", "named")
        object.__setattr__(self, "terminal", flag(self.terminal, f"terminal of Event '{self.name}'"))
        if not among(self.direction, (-1, 0, 1)):
            raise ModelError(f"direction of Event '{self.name}' is -1, 0 or 1, got {self.direction!r}")

    @property
    def kind(self) -> str:
        """'event'; 'machine' of one that happens with something else, a machine of one state."""
        return "event" if self.on is None else "machine"

    @property
    def details(self) -> str:
        """What it happens with."""
        return "" if self.on is None else f", with {self.on!r}"

    def mentions(self) -> list[Mention]:
        """What its guard depends on, and the names that it resets."""
        guard = [] if self.guard is None else self.guard.mentions()
        return [*guard, *(self.reset if isinstance(self.reset, Mapping) else ())]

    def parameters(self) -> dict[str, float]:
        """Those of its guard."""
        return {} if self.guard is None else self.guard.parameters()

    def domains(self) -> dict[str, Domain]:
        """Those of its guard."""
        return {} if self.guard is None else self.guard.domains()

    def faults(self) -> list[str]:
        """Those of its guard."""
        return [] if self.guard is None else self.guard.faults(self.name)

    # the promise of machines, for one that happens with something else ---------------------------------------------

    def initial(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """It waits."""
        return (0.0,)

    def quantities(self, scope: Scope, held: Sequence[Node]) -> Mapping[str, Scalar]:
        """None."""
        return {}

    def changes(self, scope: Scope, held: Sequence[Node]) -> Sequence[Change]:
        """It happens, and waits again."""
        return [Change(self.name, 0, 0, on=str(self.on), reset=self.reset, terminal=self.terminal)]

    def first_values(self, scope: Scope, held: Sequence[Node]) -> Mapping[int, Scalar]:
        """Nothing."""
        return {}
