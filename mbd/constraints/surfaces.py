"""What a foot stands on: planes, on any body, and height functions, which may move with time."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any, cast

from mbd.bodies.algebra import basis, cross, derivatives_at, difference, dot, rotate, scaled, total, transpose
from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope, Triple
from mbd.bodies.values import Vector3, number, triple, unit_vector
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import frame_of
from mbd.tape.functions import sqrt
from mbd.tape.node import Scalar
from mbd.tape.tracing import Argument, traced_scalar

STILL: Vector3 = (0.0, 0.0, 0.0)

PLACES = ("x", "z", "t")
"""What a height may depend on."""


@dataclass(frozen=True)
class Plane:
    """A plane ``n · s = offset`` with the open side along n; s is the place in the axes of the plane.

    ``s = R_Fᵀ (p − p_F) − u t``: with a frame F it is fixed on the body of F, so that whoever stands on it pushes that
    body back; with a velocity u it runs along like the belt of a treadmill (or rises, where u has a part along n). On
    the ground and at rest s is p.

    Parameters
    ----------
    normal : n in the axes of the frame, of any length; y by default
    offset : distance of the plane from the frame's origin along n [m]
    frame : F, a frame of any body; None for the ground's axes and origin
    velocity : u of the surface in the axes of the frame, constant; a belt of changing speed is a body of its own [m/s]

    Raises
    ------
    ModelError
        where a value is not what it should be.
    """

    normal: Vector3 = (0.0, 1.0, 0.0)
    offset: float = 0.0
    frame: Frame | None = None
    velocity: Vector3 = STILL

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", unit_vector(self.normal, "normal of a Plane"))
        object.__setattr__(self, "offset", number(self.offset, "offset of a Plane"))
        object.__setattr__(self, "velocity", triple(self.velocity, "velocity of a Plane"))
        if self.frame is not None:
            frame_of(self.frame, "frame of a Plane")

    @property
    def is_moving(self) -> bool:
        """Whether it is fixed on a body, or runs."""
        return self.frame is not None or self.velocity != STILL

    def place(self, p: Triple, scope: Scope) -> Triple:
        """s of a point."""
        if self.frame is not None:
            own = scope.frame(self.frame)
            p = rotate(transpose(own.rotation), difference(p, own.position))
        return p if self.velocity == STILL else difference(p, scaled(scope.time, self.velocity))

    def gap(self, p: Triple, scope: Scope) -> Scalar:
        """n · s − offset."""
        return dot(self.normal, self.place(p, scope)) - self.offset

    def slip(self, p: Triple, held: Triple, scope: Scope) -> Triple:
        """How far a point has moved on it from the place that is held."""
        return difference(self.place(p, scope), held)

    def directions(self, held: Triple, scope: Scope) -> tuple[Triple, Triple]:
        """Forward and sideways in the plane's axes; x and z on level ground."""
        return self.along

    @property
    def along(self) -> tuple[Vector3, Vector3]:
        """The same; x and y where the normal is z."""
        x, y, z = self.normal
        if abs(z) > 0.999:
            return basis(self.normal)
        flat = (1.0 - z * z) ** 0.5
        sideways = (-z * x / flat, -z * y / flat, flat)
        return cast(Vector3, cross(self.normal, sideways)), sideways

    def turned(self, direction: Triple, scope: Scope) -> Triple:
        """A direction of the plane in ground axes."""
        return direction if self.frame is None else rotate(scope.frame(self.frame).rotation, direction)

    def normal_at(self, p: Triple, scope: Scope) -> Triple:
        """n in ground axes."""
        return self.turned(self.normal, scope)

    def velocity_at(self, p: Triple, scope: Scope) -> Triple:
        """Velocity of the plane's material at a place, ``v_F + ω_F × (p − p_F) + R_F u`` [m/s]."""
        own = self.turned(self.velocity, scope)
        if self.frame is None:
            return own
        motion = scope.frame(self.frame)
        around = cross(motion.angular_velocity, difference(p, motion.position))
        return total(total(motion.velocity, around), own)


@dataclass(frozen=True)
class Surface:
    """A height function ``y = H`` of x, z and t: a Python function, or a sympy expression.

    ``g = (y − H)/√(1 + H_x² + H_z²)``, which is the distance to first order. Where H depends on t the ground's material
    moves up and down, and a foot that sticks moves up and down with it.
    """

    function: Any

    @property
    def arguments(self) -> tuple[str, ...]:
        """What H is called with, in order: 'x', 'z', 't'."""
        return _arguments(self.function)

    @property
    def is_moving(self) -> bool:
        """Whether H depends on time."""
        return "t" in self.arguments

    @property
    def frame(self) -> None:
        """None: heights are those of the ground, which no body carries."""
        return

    def slopes(self, p: Triple, scope: Scope) -> tuple[Scalar, Scalar, Scalar]:
        """H, ∂H/∂x, ∂H/∂z."""
        across = [name for name in self.arguments if name != "t"]

        def height(*places: Scalar) -> Scalar:
            return self._height({**dict(zip(across, places, strict=True)), "t": scope.time}, scope)

        value, slopes = derivatives_at(height, [p["xyz".index(name)] for name in across], scope.tape)
        slope: dict[str, Scalar] = dict(zip(across, slopes, strict=True))
        return value, slope.get("x", 0.0), slope.get("z", 0.0)

    def _height(self, places: Mapping[str, Scalar], scope: Scope) -> Scalar:
        """H at values of what it depends on."""
        arguments: list[Argument] = [(name, places[name]) for name in self.arguments]
        return traced_scalar(self.function, arguments, "height of the ground", scope.tape)

    def turned(self, direction: Triple, scope: Scope) -> Triple:
        """A direction of the ground in ground axes."""
        return direction

    def velocity_at(self, p: Triple, scope: Scope) -> Triple:
        """Velocity of the ground's material, which moves up and down: (0, ∂H/∂t, 0) [m/s]."""
        known = {"x": p[0], "z": p[2]}
        _, (rise,) = derivatives_at(lambda t: self._height({**known, "t": t}, scope), [scope.time], scope.tape)
        return (0.0, rise, 0.0)

    def place(self, p: Triple, scope: Scope) -> Triple:
        """The point, or where H moves (x, y − H, z)."""
        return (p[0], p[1] - self.slopes(p, scope)[0], p[2]) if self.is_moving else p

    def gap(self, p: Triple, scope: Scope) -> Scalar:
        """(y − H)/√(1 + H_x² + H_z²)."""
        H, along, across = self.slopes(p, scope)
        scale: Scalar = sqrt(1.0 + along * along + across * across)
        return (p[1] - H) / scale

    def slip(self, p: Triple, held: Triple, scope: Scope) -> Triple:
        """How far a point has moved from the place that is held, in ground axes; that place rises and falls with H."""
        if self.is_moving:
            held = (held[0], self.slopes(held, scope)[0] + held[1], held[2])
        return difference(p, held)

    def directions(self, held: Triple, scope: Scope) -> tuple[Triple, Triple]:
        """Forward (1, H_x, 0) and sideways, across it and the normal."""
        _, along, across = self.slopes(held, scope)
        forward = scaled(1.0 / sqrt(1.0 + along * along), (1.0, along, 0.0))
        normal = scaled(1.0 / sqrt(1.0 + along * along + across * across), (-along, 1.0, -across))
        return forward, cross(forward, normal)

    def normal_at(self, p: Triple, scope: Scope) -> Triple:
        """(−H_x, 1, −H_z), of length 1, over a place."""
        _, along, across = self.slopes(p, scope)
        return scaled(1.0 / sqrt(1.0 + along * along + across * across), (-along, 1.0, -across))


def spin_about(normal: Triple, frame: Frame, carrier: Frame | None, scope: Scope) -> Scalar:
    """n · (ω − ω_carrier) of a frame; of a carrier None, the ground, n · ω."""
    turning = scope.frame(frame).angular_velocity
    if carrier is not None:
        turning = difference(turning, scope.frame(carrier).angular_velocity)
    return dot(normal, turning)


def surface_of(ground: Any, what: str, besides: str = "") -> Plane | Surface:
    """A ground as users may give it, checked at the border; `besides`: what else it may be, for the error."""
    if ground is None:
        return Plane()
    if isinstance(ground, Plane | Surface):
        return ground
    if callable(ground) or hasattr(ground, "free_symbols"):
        _arguments(ground)
        return Surface(ground)
    raise ModelError(
        f"{what}: the ground is {besides}a mbd.Plane, or a height function y = H(x), H(x, z) or one that moves with t, "
        f"got {ground!r}"
    )


def _arguments(function: Any) -> tuple[str, ...]:
    """The arguments of a height function by the names of its parameters; unknown names take what is left of x, z."""
    if hasattr(function, "free_symbols") and not hasattr(function, "signature"):
        symbols = {str(symbol) for symbol in function.free_symbols}
        return ("x", *(name for name in "zt" if name in symbols))
    names = _parameters(function)
    left = [name for name in "xz" if name not in names]
    unknown = [name for name in names if name not in PLACES]
    if len(unknown) > len(left):
        raise ModelError(
            f"touchdown: a height function is called with x, z and t, or with some of them; this one asks for "
            f"{', '.join(names)}; bring further values along as defaults, such as lambda x, t, k=2.0: …"
        )
    meant = dict(zip(unknown, left, strict=False))
    return tuple(meant.get(name, name) for name in names)


def _parameters(function: Any) -> list[str]:
    """Names of the parameters that stand before those with a default, x, z, t always among them."""
    if hasattr(function, "free_symbols"):  # a sympy Lambda
        return [str(symbol) for symbol in function.signature]
    try:
        found = inspect.signature(function).parameters.values()
    except ValueError:
        return ["x"]
    places = [each for each in found if each.kind in (each.POSITIONAL_ONLY, each.POSITIONAL_OR_KEYWORD)]
    wanted = [each.name for each in places if each.default is each.empty or each.name in PLACES]
    if wanted != [each.name for each in places[: len(wanted)]]:
        raise ModelError(
            f"touchdown: a height function takes x, z and t before parameters with a default, got "
            f"({', '.join(each.name for each in places)}); change their order"
        )
    return wanted or ["x"]
