"""The model: a mechanism in words, and what follows from it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mbd.bodies.domains import ParameterCheck
from mbd.bodies.values import flag
from mbd.notebook import Faults, Text
from mbd.notes import doubt
from mbd.topology.description import Description

if TYPE_CHECKING:
    from mbd.equations.cost import Cost

INSTEAD = {
    "; model.without() is a copy": ("copy", "clone", "deepcopy"),
    "; mbd.simulate(model, mbd.assemble(model, position={…}), until=1.0) makes a run": ("simulate", "run", "solve"),
    "; mbd.assemble(model, position={…}) makes a start": ("assemble", "initialize", "start"),
    "; joints go to model.connect, contacts and constraints to constrain, forces to apply": (
        "add", "add_joint", "add_body", "add_link", "add_force", "add_constraint", "add_contact", "append",
    ),
}  # fmt: skip
"""What to write in the place of attributes that models of other programs have."""


class Model(Description):
    """A mechanism in words: bodies connected by joints, under forces and constraints.

    Parameters
    ----------
    name : its name
    gravity : in ground axes [m/s²]
    cut : which joints become rows instead of coordinates: 'auto' and 'loops' cut what closes a loop, 'all' cuts
        every joint (absolute coordinates), a list of names cuts those
    tunable : names of parameters that stay run-time inputs although they are 0 or ±1

    A model pickles as its description; functions in it must then be those of a module, not lambdas.

    Examples
    --------
    >>> from mbd.bodies import Link
    >>> from mbd.joints import Revolute
    >>> model = Model("pendulum")
    >>> rod = Link("rod", mass=1.0, length=1.0, center=0.5, inertia=1 / 12)
    >>> model.connect(Revolute("pin", model.ground.origin, rod.start))
    >>> model.check()
    []
    """

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Asked for what is no attribute: what other programs call so."""
            hint = next((text for text, others in INSTEAD.items() if name in others), "")
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}{hint}")

    def check(self) -> list[str]:
        """Every fault of the description, one sentence each; empty where there is none.

        Functions are traced: what `assemble` would refuse is found here too.

        Warns (`mbd.MbdWarning`) once of what is no fault but was hardly meant, such as a hinge connected twice.
        """
        from mbd.equations.derivation import derivation_faults
        from mbd.topology.check import faults
        from mbd.topology.doubts import doubts

        found = faults(self) or derivation_faults(self)
        if not found:
            doubt(*doubts(self), of=self)
        return Faults(found)

    def parameter_check(self) -> ParameterCheck:
        """The same judgement of values that differ from those of the description."""
        from mbd.topology.check import parameter_check

        return parameter_check(self)

    def require_valid(self) -> None:
        """Raise a `ModelError` with every fault, if there is one."""
        from mbd.topology.check import require_valid

        require_valid(self)

    def describe(self, mobility: bool = False) -> str:
        """The mechanism in a page of text.

        Parameters
        ----------
        mobility : whether to derive the equations too and tell the degrees of freedom by the rank of the rows, which
            rows are redundant and which conflict; see `mbd.mobility`
        """
        from mbd.topology.describe import description

        self.require_own()
        text = description(self)
        if flag(mobility, "mobility of describe") and not self.check():
            from mbd.assembly.mobility import mobility as of

            text += f"\n{of(self)}"
        return Text(text)

    def equations(self, latex: bool = False) -> str:
        """The equations of motion, printed as text or LaTeX; a notebook shows them as formulas."""
        from mbd.equations import derive
        from mbd.equations.printing import report

        return report(derive(self), latex)

    def cost(self) -> Cost:
        """Operations of each effect."""
        from mbd.equations.cost import cost

        return cost(self)

    def _repr_html_(self) -> str:
        from mbd.topology.describe import in_html, parts

        return in_html(repr(self), parts(self))
