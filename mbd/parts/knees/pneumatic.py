"""A knee with a pneumatic cylinder."""

import math
from typing import Any

from mbd.bodies.base import Frame
from mbd.errors import ModelError
from mbd.forces.potential import Potential
from mbd.joints.losses.base import Loss
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import Stop, check, sizes
from mbd.parts.knees.hinge import stop_knee
from mbd.tape.functions import exp, log
from mbd.topology.description import Description


def gas_energy(angle: Any, pressure: Any, volume: Any, swept: Any, exponent: Any) -> Any:
    """``U = p₀ [V₀/(n − 1) ((V₀/V)^(n−1) − 1) + V − V₀]``, V = V₀ + s q: of a gas pV^n = const in an atmosphere of p₀
    [J].

    >>> round(gas_energy(-1.0, 1e5, 6e-5, 1.2e-5, 1.3), 4)
    0.1847
    """
    now = volume + swept * angle
    return pressure * (volume / (exponent - 1.0) * (exp((exponent - 1.0) * log(volume / now)) - 1.0) + now - volume)


def pneumatic_knee(
    model: Description, name: str, thigh: Frame, shank: Frame, *, volume: float, swept: float,
    pressure: float = 101325.0, exponent: float = 1.3, stop: Stop = None, loss: Loss | None = None, anatomy: str = "",
) -> Revolute:  # fmt: skip
    """A single axis that compresses air as it bends: ``p V^n = p₀ V₀^n``, ``V = V₀ + s q``, ``M = s (p − p₀)``.

    A polytropic spring without leak: passive, and what it stores it gives back; losses of valves go into `loss`. n is 1
    for slow motion, which exchanges heat, and 1.4 for quick. C. W. Radcliffe & L. Lamoreux, UC-BL pneumatic swing-
    control unit for above-knee prostheses, Bull. Prosthetics Research 10-10 (1968) 73.

    Parameters
    ----------
    model, name : the model, and the name of the hinge; the spring is '<name> air' with the parameters 'pressure',
        'volume', 'swept', 'exponent'
    thigh, shank : the frames that it joins
    volume : V₀ of the straight knee [m³], more than is swept in flexion by 180°
    swept : s, volume per angle, the piston's area times its arm [m³/rad]
    pressure : p₀ outside, and inside of the straight knee [Pa]
    exponent : n > 1
    stop : as of `stop_knee`
    loss : as of `stop_knee`

    Raises
    ------
    ModelError
        where the cylinder would be empty at 180°, or a number is not positive.
    anatomy : the joint of the body that it is, 'left knee', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> thigh = mbd.Link("thigh", mass=7.0, length=0.4, center=0.2, inertia=0.1)
    >>> model, shank = mbd.Model("leg"), mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    >>> model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start))
    >>> knee = mbd.parts.pneumatic_knee(model, "left knee", thigh.end, shank.start, volume=6e-5, swept=1.2e-5)
    >>> model.check(), model.parameters["left knee air.exponent"]
    ([], 1.3)
    """  # fmt: skip
    check(model, name, "pneumatic_knee")
    given = {"pressure": pressure, "volume": volume, "swept": swept, "exponent": exponent}
    p, V, s, n = sizes(f"pneumatic_knee '{name}'", **given)
    if math.pi * s >= V:
        raise ModelError(
            f"pneumatic_knee '{name}': its cylinder of {V:g} m³ is empty in flexion by {math.degrees(V / s):.0f}°; "
            "give a volume of more than what is swept in 180°"
        )
    if n <= 1.0:
        raise ModelError(f"exponent of pneumatic_knee '{name}' must be above 1, got {n:g}; use 1.001 for slow motion")
    knee = stop_knee(model, name, thigh, shank, stop=stop, loss=loss, anatomy=anatomy)
    values = zip(given, (p, V, s, n), strict=True)
    model.apply(Potential(f"{name} air", gas_energy, (f"{name}.angle", *values)))
    return knee
