"""The socket that a limb sits in."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.given import Numbers
from mbd.bodies.values import triple
from mbd.forces.potential import Potential
from mbd.joints.losses.viscous import Viscous
from mbd.joints.planar import Planar
from mbd.parts.arguments import between, check
from mbd.topology.description import Description


def elastic_socket(
    model: Description, name: str, limb: Frame, socket: Frame, *, stiffness: Numbers, damping: Numbers
) -> Planar:
    """A pseudo-joint of three freedoms: springs and dampers across, along and about; ``V = ½ Σ kᵢ qᵢ²``, ``D = ½ Σ cᵢ
    q̇ᵢ²``.

    Passive. A. K. LaPrè, M. A. Price, R. D. Wedge, B. R. Umberger & F. C. Sup, Approach for gait analysis in persons
    with limb loss including residuum and prosthesis socket dynamics, Int. J. Numer. Methods Biomed. Eng. 34 (2018)
    e2936.

    Parameters
    ----------
    model, name : the model, and the name of the joint with the coordinates 'x', 'y' (pistoning) and 'angle'; its
        springs are '<name> x spring', '<name> y spring' and '<name> angle spring', each with the parameter 'stiffness'
    limb, socket : the frames that it joins, of the residual limb and of the socket
    stiffness : k of x, y [N/m] and angle [N m/rad]
    damping : c of x, y [N s/m] and angle [N m s/rad]

    >>> import mbd
    >>> limb = mbd.Link("limb", mass=7.0, length=0.3, center=0.15, inertia=0.05)
    >>> model, socket = mbd.Model("leg"), mbd.Link("socket", mass=1.0, length=0.1, center=0.05, inertia=0.002)
    >>> model.connect(mbd.Revolute("hip", model.ground.origin, limb.start))
    >>> how = {"stiffness": (3e4, 6e4, 800.0), "damping": (100.0, 200.0, 3.0)}
    >>> fit = mbd.parts.elastic_socket(model, "fit", limb.end, socket.start, **how)
    >>> model.check(), model.parameters["fit y spring.stiffness"]
    ([], 60000.0)
    """
    check(model, name, "elastic_socket")
    between("elastic_socket", name, limb=limb, socket=socket)
    springs, dampers = triple(stiffness, f"stiffness of '{name}'"), triple(damping, f"damping of '{name}'")
    ways = ("x", "y", "angle")
    fit = Planar(name, limb, socket, loss={way: Viscous(c) for way, c in zip(ways, dampers, strict=True)})
    model.connect(fit)
    for way, k in zip(ways, springs, strict=True):
        model.apply(Potential(f"{name} {way} spring", _stored, (f"{name}.{way}", ("stiffness", k))))
    return fit


def _stored(stretch: Any, stiffness: Any) -> Any:
    """½ k q²."""
    return 0.5 * stiffness * stretch * stretch
