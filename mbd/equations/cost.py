"""What the equations cost in scalar operations, in all and for each effect."""

from collections.abc import Mapping, Sequence
from typing import Any

from mbd.dataclass import dataclass
from mbd.equations.equations import Equations
from mbd.equations.programs import ActiveSet, accelerations, guards, newton, residual
from mbd.notebook import table
from mbd.tape.derivatives import live
from mbd.tape.node import Node


def operations(nodes: Sequence[Node]) -> int:
    """Scalar operations that some outputs take, each counted once."""
    return sum(1 for node in live(nodes) if node.args)


@dataclass(frozen=True)
class Cost:
    """Scalar operations of the programs that a run calls.

    Parameters
    ----------
    newton : tangent and residual of one Newton iteration, index 3, with no contact closed
    residual : of the residual alone
    accelerations : mass matrix, forces and all rows, for starts, impacts and restarts
    guards : what is watched after every step
    effects : how much `newton` shrinks without an effect
    contacts : how much `newton` grows while a contact is closed, and sticks if it has friction
    frictions : how much it grows while a dry friction slides, its contact being closed
    """

    name: str
    newton: int
    residual: int
    accelerations: int
    guards: int
    effects: Mapping[str, int]
    contacts: Mapping[str, int]
    frictions: Mapping[str, int]

    def __repr__(self) -> str:
        width = max([30, *(len(name) + 4 for name in (*self.effects, *self.contacts, *self.frictions))])
        programs = ("newton", "residual", "accelerations", "guards")
        lines = [f"{self.name + ', operations':<{width}}"]
        lines += [f"{program:<{width}}{getattr(self, program):>8}" for program in programs]
        parts = {
            "of newton, by effect": self.effects, "added while closed": self.contacts,
            "added while it slides": self.frictions,
        }  # fmt: skip
        for title, counts in parts.items():
            if counts:
                lines += [title, *(f"  {name:<{width - 2}}{count:>8}" for name, count in counts.items())]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        names = ("newton", "residual", "accelerations", "guards")
        programs = [(name, getattr(self, name), "program") for name in names]
        parts = {
            "of newton, by effect": self.effects, "added while closed": self.contacts,
            "added while it slides": self.frictions,
        }  # fmt: skip
        rows = [(name, count, title) for title, counts in parts.items() for name, count in counts.items()]
        return table(f"cost of {self.name}", ("what", "operations", "kind"), [*programs, *rows])


def cost(model: Any) -> Cost:
    """Operations of a model, and of each of its effects: with it, minus without it.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`, anything with ``without(name)`` that `derive` takes
    """
    from mbd.equations.derivation import derive

    described = [controller.name for controller in getattr(model, "controllers", ())]
    model = model.without(*described) if described else model  # they take no operation, and may need an effect
    equations = derive(model)
    base = _newton(equations)
    rubbing = {f"{friction.name} friction": k for k, friction in enumerate(equations.frictions)}
    effects = [effect.name for effect in equations.effects if effect.contact < 0 and effect.name not in rubbing]
    return Cost(
        equations.name,
        newton=base,
        residual=operations(residual(equations, ActiveSet(equations.bilateral, (), False))),
        accelerations=operations(accelerations(equations)),
        guards=operations(guards(equations)),
        effects={name: base - _newton(derive(model.without(name))) for name in effects},
        contacts={c.name: _newton(equations, k) - base for k, c in enumerate(equations.contacts)},
        frictions={name: _sliding(equations, k) - base for name, k in rubbing.items()},
    )


def _sliding(equations: Equations, friction: int) -> int:
    """Operations of one Newton iteration with one friction sliding, its contact closed."""
    contact = equations.frictions[friction].contact
    rows = [] if contact < 0 else [k for k in equations.contacts[contact].rows if equations.rows[k].friction < 0]
    sliding = equations.frictions[friction].group or (friction,)
    return operations(newton(equations, ActiveSet([*equations.bilateral, *rows], (), False, sliding)))


def _newton(equations: Equations, closed: int | None = None) -> int:
    """Operations of one Newton iteration, with one contact closed or none."""
    contact = () if closed is None else equations.contacts[closed].rows
    penalties = () if closed is None or contact else (closed,)
    return operations(newton(equations, ActiveSet([*equations.bilateral, *contact], penalties, False)))
