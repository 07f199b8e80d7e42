"""A damper between two points."""

from collections.abc import Mapping
from typing import Any

from mbd.bodies.algebra import difference, dot, norm
from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope
from mbd.bodies.values import is_number, name_of
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import Action, Force, Result, frame_of
from mbd.forces.quantities import Mention
from mbd.joints.losses.base import Loss, loss_of, rates_of
from mbd.joints.losses.viscous import Viscous


@dataclass(frozen=True)
class Damper(Force):
    """A damper along the line between two points, which must not meet.

    ``F = F(ḋ)``, d = |p_b − p_a|, ``ḋ = (p_b − p_a)·(v_b − v_a)/d``; it pulls while d grows.

    Parameters
    ----------
    name : its name
    a, b : its end frames
    loss : a number c [N s/m], which is Viscous(c), or any loss that does not truly stick (an orifice, a table)

    Raises
    ------
    ModelError
        for a loss that truly sticks, which only a joint or a contact can hold.
    """

    name: str
    a: Frame
    b: Frame
    loss: float | Loss

    kind = "loss"

    def __post_init__(self) -> None:
        name_of(self.name, "Damper")
        frame_of(self.a, f"first end of Damper '{self.name}'")
        frame_of(self.b, f"second end of Damper '{self.name}'")
        given: Any = self.loss
        loss = Viscous(given) if is_number(given) else loss_of(given, self.name)
        object.__setattr__(self, "loss", loss if loss is not None else loss_of("None", self.name))
        if self.law.sticks:
            raise ModelError(
                f"loss of Damper '{self.name}' truly sticks, {self.law!r}, which takes a joint or a contact: give it a "
                "smoothing, as mbd.Coulomb(T, smoothing=0.01), or connect a mbd.Prismatic along the line with this loss"
            )

    @property
    def law(self) -> Loss:
        """Its loss."""
        assert isinstance(self.loss, Loss)  # a number has become one
        return self.loss

    def mentions(self) -> list[Mention]:
        """Its ends."""
        return [self.a, self.b]

    def parameters(self) -> dict[str, float]:
        """Those of its loss: 'name.coefficient', …"""
        return self.law.parameters(self.name)

    def value_faults(self, values: Mapping[str, float]) -> list[str]:
        """Those of its loss."""
        return self.law.value_faults(self.name, values)

    def faults(self) -> list[str]:
        """Those of its loss, ends that are one."""
        faults = self.law.faults(self.name)
        if self.a.body is self.b.body:
            faults.append(f"damper '{self.name}': both ends are on '{self.a.body.name}', so it does nothing")
        return faults

    def act(self, scope: Scope) -> Action:
        """−F(ḋ) on ḋ."""
        a, b = scope.frame(self.a), scope.frame(self.b)
        arm = difference(b.position, a.position)
        rate = dot(arm, difference(b.velocity, a.velocity)) / norm(arm)
        stored = self.law.elastic(scope, self.name) if self.law.has_states else None
        pairs = ((rate, -self.law.force(rate, scope, self.name)),)
        return Action(pairs, stored, rates=tuple(rates_of(self.law, rate, scope, self.name)))

    def results(self) -> dict[str, Result]:
        """'force': F(ḋ), which pulls its ends together where it is positive [N]."""
        return {"force": Result(lambda scope: -self.act(scope).pairs[0][1])}
