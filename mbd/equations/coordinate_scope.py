"""The derivation as words see it where there are generalized coordinates and no bodies."""

import re
from collections.abc import Collection, Mapping, Sequence
from typing import NoReturn

from mbd.bodies.base import Frame
from mbd.equations.dynamics import Work
from mbd.equations.equations import Coordinate
from mbd.equations.kinematic_proxies import View
from mbd.equations.parameter_scope import ParameterScope
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.joints.base import Joint
from mbd.tape.derivatives import jvp, vjp
from mbd.tape.node import Node, Scalar


def identifier(name: str) -> str:
    """The name as a Python argument: 'hip.angle' → 'hip_angle'."""
    return re.sub(r"\W", "_", name)


class _NoViews:
    """Expressions contain the motion itself: nothing stands for places and velocities."""

    def real(self, outputs: Sequence[Node]) -> list[Node]:
        return list(outputs)

    def inside(self, outputs: Sequence[Node]) -> list[View]:
        return []

    def rates(self, outputs: Sequence[Node]) -> dict[Node, Scalar]:
        return {}


class CoordinateScope(ParameterScope):
    """`mbd.equations.derivation_scope.DerivationScope` over coordinates that form a vector; forces act on these.

    Parameters
    ----------
    coordinates : their names
    values : parameters by name
    tunable : names of parameters that stay inputs even at an exact 0 or ±1

    Attributes
    ----------
    q : q ⊕ x of each coordinate
    known : what words and expressions may ask for by name: 't', coordinates, rates ('theta_rate', 'theta.rate'),
        parameters, and these with '_' in place of other characters
    """

    def __init__(self, coordinates: Sequence[str], values: Mapping[str, float], tunable: Collection[str]) -> None:
        super().__init__(len(coordinates), len(coordinates), tunable)
        self.views = _NoViews()
        self.cuts: tuple[Joint, ...] = ()
        self.states: list[tuple[Coordinate, Node]] = []
        self.q = [q + x for q, x in zip(self.inputs.q, self.inputs.x, strict=True)]
        self.known: dict[str, Scalar] = {"t": self.inputs.t}
        for name, q, v in zip(coordinates, self.q, self.inputs.v, strict=True):
            self.known |= {name: q, f"{name}_rate": v}
        self.known |= {name: self.parameters.node(name, value) for name, value in values.items()}
        self._spelled = {identifier(name): name for name in self.known}
        self._spelled |= {f"{name}.rate": f"{name}_rate" for name in coordinates}

    # what words ask -------------------------------------------------------------------------------------------------
    def frame(self, frame: Frame) -> NoReturn:
        """There are none."""
        raise ModelError(f"a Lagrangian has no bodies, and no frame '{frame.full_name}'; use its coordinates")

    def joint(self, name: str) -> NoReturn:
        """There are none."""
        raise ModelError(f"a Lagrangian has no joints, and no '{name}'; use its coordinates")

    def named(self, name: str) -> Node:
        """A coordinate, a rate or a parameter."""
        found = self._spelled.get(name, name)
        if found not in self.known:
            raise UnknownNameError(nearest(name, self.known, "quantity", "Known are"))
        return self.tape.lift(self.known[found])

    def inertia(self, coordinates: Sequence[str]) -> NoReturn:
        """Energies are given as a whole, forces on them among their laws."""
        raise ModelError("mass_matrix and bias_forces are of a Model; a Lagrangian's forces know its energies")

    def offer(self, name: str, value: Scalar) -> None:
        """Let words and expressions ask for one more quantity."""
        self.known[name] = value
        self._spelled[identifier(name)] = name

    def knows(self, name: str) -> bool:
        """Whether `named` does."""
        return self._spelled.get(name, name) in self.known

    def state(self, owner: str, field: str, initial: float) -> Node:
        """A first-order state; registered on first use."""
        name = f"{owner}.{field}"
        if name not in self.known:
            self.known[name] = self.tape.input("z", len(self.states))
            self.states.append((Coordinate(name, "", initial), self.tape.lift(self.known[name])))
        return self.tape.lift(self.known[name])

    # derivatives ----------------------------------------------------------------------------------------------------
    def cut_rows(self, joint: Joint) -> NoReturn:
        """There are none."""
        self.joint(joint.name)

    def real(self, value: Scalar) -> Node:
        """The expression itself."""
        return self.tape.lift(value)

    def rates(self, values: Sequence[Node]) -> list[Node]:
        """d/dt of functions of t and q ⊕ x."""
        return jvp(values, {self.time: 1.0, **dict(zip(self.inputs.x, self.inputs.v, strict=True))})

    def rate(self, value: Scalar) -> Node:
        """d/dt of one of them."""
        return self.rates([self.tape.lift(value)])[0]

    def change(self, value: Scalar) -> Node:
        """d/dt of a function of t, q ⊕ x, v and z."""
        seeds: dict[Node, Scalar] = {self.time: 1.0, **dict(zip(self.inputs.x, self.inputs.v, strict=True))}
        seeds |= dict(zip(self.inputs.v, self.inputs.a, strict=True))
        seeds |= {node: self.tape.input("s", k) for k, (_, node) in enumerate(self.states)}
        return jvp([self.tape.lift(value)], seeds)[0]

    def generalized(self, work: Work) -> list[Node]:
        """Σ multiplier ∂value/∂x + Σ force ∂velocity/∂v (length n_v)."""
        total = [self.tape.zero] * len(self.inputs.x)
        if work.values:
            total = [a + b for a, b in zip(total, vjp(work.values, work.multipliers, self.inputs.x), strict=True)]
        if work.velocities:
            total = [a + b for a, b in zip(total, vjp(work.velocities, work.forces, self.inputs.v), strict=True)]
        return total
