"""A knee with a hydraulic cylinder."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.values import is_number
from mbd.joints.losses.base import Loss
from mbd.joints.losses.quadratic import Quadratic
from mbd.joints.losses.valves import Valves
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import Stop, added, check, sizes
from mbd.parts.knees.hinge import stop_knee
from mbd.topology.description import Description


def orifice(*, piston: float, opening: float, arm: float, density: float = 870.0, discharge: float = 0.61) -> float:
    """``c = ρ A³ r³/(2 C_d² a²)`` of the torque ``c |ω| ω`` of a cylinder on an arm that presses oil through an
    orifice.

    From ``Q = C_d a √(2 Δp/ρ)``, Q = A r ω and M = A r Δp. H. E. Merritt, Hydraulic Control Systems (1967), § 3.2, with
    C_d = 0.61 of a sharp edge.

    Parameters
    ----------
    piston : A [m²]
    opening : a of the orifice [m²]
    arm : r of the cylinder about the joint [m]
    density : ρ of the oil [kg/m³]
    discharge : C_d [-]

    >>> round(orifice(piston=3e-4, opening=2e-6, arm=0.03), 3)  # [N m s²/rad²]
    0.213
    """
    A, a, r, rho, C = sizes("orifice", piston=piston, opening=opening, arm=arm, density=density, discharge=discharge)
    return 0.5 * rho * (A * r) ** 3 / (C * a) ** 2


def hydraulic_knee(
    model: Description, name: str, thigh: Frame, shank: Frame, *, flexion: Any, extension: Any, stop: Stop = None,
    loss: Loss | None = None, anatomy: str = "",
) -> Revolute:  # fmt: skip
    """A single axis with a cylinder whose check valves lead flexion and extension through orifices of their own.

    ``M = c |ω| ω`` with c of flexion where ω < 0, of extension where ω > 0. Passive. A. Staros & E. F.
    Murphy, Properties of fluid flow applied to above-knee prostheses, Bull. Prosthetics Research 10-1 (1964) 40.

    Parameters
    ----------
    model, name : the model, and the name of the hinge; the run-time parameters are '<name> loss.backward.coefficient'
        (flexion) and '<name> loss.forward.coefficient' (extension), or '<name> loss.valves.…' beside another loss
    thigh, shank : the frames that it joins
    flexion, extension : c [N m s²/rad²], such as of `orifice`, or any loss that does not stick
    stop : as of `stop_knee`
    loss : beside them, such as Viscous(0.3) of seals
    anatomy : the joint of the body that it is, 'left knee', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> thigh = mbd.Link("thigh", mass=7.0, length=0.4, center=0.2, inertia=0.1)
    >>> model, shank = mbd.Model("leg"), mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    >>> model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start))
    >>> knee = mbd.parts.hydraulic_knee(model, "left knee", thigh.end, shank.start, flexion=0.8, extension=0.2)
    >>> model.check(), model.parameters["left knee loss.backward.coefficient"]
    ([], 0.8)
    """  # fmt: skip
    check(model, name, "hydraulic_knee")
    bend, stretch = (Quadratic(value) if is_number(value) else value for value in (flexion, extension))
    return stop_knee(
        model, name, thigh, shank, stop=stop, loss=added(name, Valves(bend, stretch), loss), anatomy=anatomy
    )
