"""An electric motor with its current."""

from typing import Any

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of, number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import Action, Force, Result, joint_of
from mbd.forces.quantities import Mention, OfQuantities, Quantity, arguments_of, mentioned, quantity_of, scalar
from mbd.joints.base import Joint
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class DCMotor(OfQuantities, Force):
    """A direct-current motor on the coordinate q of a joint: ``T = k i``, ``L di/dt = u − R i − k q̇``.

    The current i is a first-order state, 'name.current', and begins at 0 unless `assemble` says otherwise. With L = 0
    there is none, and ``i = (u − k q̇)/R``. Short-circuited (u = 0) it only brakes: what it takes is lost in R, but for
    ``½ L i²``. Gear and rotor are words of their own: see `mbd.parts.powered_knee`.

    A. E. Fitzgerald, C. Kingsley & S. D. Umans, Electric Machinery (2003), ch. 7.

    Parameters
    ----------
    name : its name
    joint : that of the rotor: a Revolute, Screw or Prismatic joint
    voltage : u [V]: a number (the parameter 'name.voltage'), a function, a sympy expression or `Samples`
    resistance : R > 0 [Ω]
    constant : k, torque per current and voltage per rate [N m/A = V s/rad]
    inductance : L ≥ 0 [H]; an exact 0 leaves the state out
    arguments : what a function is called with, as for `Applied`
    """

    name: str
    joint: Joint
    voltage: Quantity
    resistance: float
    constant: float
    inductance: float = 0.0
    arguments: Any = ("t",)

    kind = "applied"
    column = "motor"
    quantities = ("voltage",)

    def __post_init__(self) -> None:
        name_of(self.name, "DCMotor")
        joint_of(self.joint, f"joint of DCMotor '{self.name}'")
        put = object.__setattr__
        put(self, "voltage", quantity_of(self.voltage, f"voltage of '{self.name}'"))
        put(self, "arguments", arguments_of(self.arguments, f"DCMotor '{self.name}'"))
        for field in ("resistance", "constant", "inductance"):
            put(self, field, number(getattr(self, field), f"{field} of '{self.name}'"))
        wrong = [
            fault
            for name, value in self._numbers().items()
            for fault in self.domains()[name].faults(f"DCMotor '{self.name}'", name.rpartition(".")[2], value)
        ]
        if wrong:
            raise ModelError(wrong)

    def mentions(self) -> list[Mention]:
        """Its joint, and what its voltage is called with."""
        return [self.joint, *mentioned(self.arguments)]

    def _numbers(self) -> dict[str, float]:
        fields = {"resistance": self.resistance, "constant": self.constant}
        if self.inductance != 0.0:
            fields["inductance"] = self.inductance
        return {f"{self.name}.{field}": value for field, value in fields.items()}

    def parameters(self) -> dict[str, float]:
        """`resistance`, `constant`, `inductance` unless it is 0, `voltage` where it is a number, and its arguments."""
        return self._numbers() | super().parameters()

    def domains(self) -> dict[str, Domain]:
        """R > 0, L ≥ 0, any k."""
        found = {f"{self.name}.resistance": positive(unit="Ω"), f"{self.name}.constant": Domain()}
        if self.inductance != 0.0:  # as it was made: a state is there or not
            found[f"{self.name}.inductance"] = positive("is not positive; make it with 0 for none", "H")
        return found

    def act(self, scope: Scope) -> Action:
        """k i on q̇, and the rate of i."""
        (rate,) = scope.joint(self.joint.name).rates
        k = scope.parameter(self.name, "constant", self.constant)
        current = self._current(scope)
        if self.inductance == 0.0:
            return Action(pairs=((rate, k * current),))
        L = scope.parameter(self.name, "inductance", self.inductance)
        R = scope.parameter(self.name, "resistance", self.resistance)
        state = scope.state(self.name, "current", 0.0)
        return Action(pairs=((rate, k * state),), rates=((state, (self._voltage(scope) - R * state - k * rate) / L),))

    def _voltage(self, scope: Scope) -> Scalar:
        return scalar(self.voltage, self.arguments, scope, self.name, "voltage")

    def _current(self, scope: Scope) -> Scalar:
        if self.inductance != 0.0:
            return scope.state(self.name, "current", 0.0)
        (rate,) = scope.joint(self.joint.name).rates
        k = scope.parameter(self.name, "constant", self.constant)
        return (self._voltage(scope) - k * rate) / scope.parameter(self.name, "resistance", self.resistance)

    def results(self) -> dict[str, Result]:
        """'torque' k i [N m]; 'current' [A] where it is no state, which has its name already; 'voltage' [V]."""
        found = {"voltage": Result(self._voltage)}
        if self.inductance == 0.0:
            found["current"] = Result(self._current)
        field = "torque" if self.joint.labels[0].unit == "rad" else "force"
        return found | {field: Result(lambda scope: self.act(scope).pairs[0][1])}
