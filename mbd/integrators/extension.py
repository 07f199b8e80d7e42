"""Continuous extensions of schemes: how the states between two rows of a run follow from these.

Each integrator gives one (`Integrator.between`); `mbd.results` evaluates it, and run files keep its name. With all of
them states are led onto the rows that act, and forces and multipliers come from the balance.
"""

from dataclasses import field

from mbd.dataclass import dataclass
from mbd.errors import UnknownNameError, nearest
from mbd.kernel.schemes.dormand_prince import EIGHTH_ORDER
from mbd.kernel.schemes.tableau import FOURTH_ORDER, Tableau


@dataclass(frozen=True)
class Extension:
    """One way from rows to what lies between them.

    Parameters
    ----------
    name : by which run files and integrators of one's own know it
    order : p, the error of positions and velocities between rows that are exact is of order h^p or higher, h their
        distance; between rows of a scheme of lower order it is that of the scheme
    uses_accelerations : accelerations of rows are as accurate as positions, so that curves through three rows take
        them, of degree 8 in q and 5 in states of first order; otherwise curves are cubic
    formula : of the explicit step from the row before that is taken again where that can be done; None: curves alone
    leads_steps : in long steps the explicit step of order 8, led to the row after, is taken where it is better
    """

    name: str
    order: int
    uses_accelerations: bool = True
    formula: Tableau | None = field(default=None, repr=False)
    leads_steps: bool = False


HERMITE = Extension("hermite", 4, uses_accelerations=False)
OSCULATING = Extension("quintic", 8, leads_steps=True)
STEPS_OF_ORDER_8 = Extension("stages", 8, formula=EIGHTH_ORDER)
STEPS_OF_ORDER_4 = Extension("stages of order 4", 4, formula=FOURTH_ORDER)
EXTENSIONS = {each.name: each for each in (HERMITE, OSCULATING, STEPS_OF_ORDER_8, STEPS_OF_ORDER_4)}


def extension_of(between: Extension | str) -> Extension:
    """An extension by its name, or itself.

    Raises
    ------
    UnknownNameError
        for a name that none has.
    """
    if isinstance(between, Extension):
        return between
    if between not in EXTENSIONS:
        raise UnknownNameError(nearest(str(between), EXTENSIONS, "continuous extension", "There are"))
    return EXTENSIONS[between]
