"""What pictures show beside lines of bodies: grounds that contacts touch, wheels that roll, blades.

Names of bodies and constraints are enough, with numbers where nothing moves; all else are results that are not listed,
traced when a picture asks for them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from mbd.bodies.algebra import basis, rotate, scaled, total
from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope, Triple
from mbd.bodies.values import Vector3
from mbd.constraints.balls import Ball
from mbd.constraints.base import Constraint
from mbd.constraints.disks import DiskTouchdown
from mbd.constraints.knife_edge import KnifeEdge
from mbd.constraints.rolling import Rolling
from mbd.constraints.rolling_touchdown import RollingTouchdown
from mbd.constraints.sphere_touchdown import SphereTouchdown
from mbd.constraints.surfaces import Plane, Surface
from mbd.dataclass import dataclass
from mbd.equations.held import held_contacts, offer_held
from mbd.equations.outputs import AXES, Outputs
from mbd.tape.node import Scalar
from mbd.topology.description import Description

PLACE = "place"
"""Kind of the inputs x (number 0) and z (number 1) of a height function that is drawn."""

HEIGHT = "height"

NUMBERS = {"plane": 4, "cone": 1, "solid": 7, "limb": 7}
"""How many numbers a shape of each kind has; of all others none."""

Offer = Callable[[str, str, Callable[[], Triple]], None]


def drawn(owner: str, what: str) -> str:
    """Name of a result that only pictures ask for."""
    return f"drawn:{owner}.{what}"


@dataclass(frozen=True)
class Shape:
    """Something that is drawn.

    kind : 'plane' (at rest), 'moving plane', 'surface', 'wheel', 'ball', 'blade' or 'held' (what never opens, or
        rolls); of spatial mechanisms 'solid', 'limb' (a link with a moment about its long axis), 'hinge' and 'cone' (a
        stop of directions)
    name : of the constraint that has it, or the first of them, of the body, of the joint; `drawn(name, …)` are its
        results: place, normal and forward of a moving plane, height (of PLACE and time) of a surface, spoke and axle of
        a wheel, along of a blade, first and second axis of a body, axis of a joint, arm of a contact
    contacts : the contacts that touch a ground; its directions at each where it is no plane at rest; of a disk or a
        ball its contacts, whose arm leads from the center to where they touch
    points : the frame that touches, of each contact
    place : frame of the center of a wheel or a ball, of a blade, of a body's center, of a joint
    numbers : normal and offset of a plane at rest; half the angle of a cone [rad]; of a solid or a limb
        mass and Ixx, Iyy, Izz, Ixy, Ixz, Iyz
    across : of a surface, the names of what its height depends on, such as 'xt'
    form : of a solid, 'box', 'cylinder' or 'ball' where words of the model tell it; of what is held 'normal' or 'grip'
    """

    kind: str
    name: str
    contacts: tuple[str, ...] = ()
    points: tuple[str, ...] = ()
    place: str = ""
    numbers: tuple[float, ...] = ()
    across: str = ""
    form: str = ""

    def __post_init__(self) -> None:
        assert len(self.numbers) == NUMBERS.get(self.kind, 0), self.kind  # files are refused otherwise


def shapes_of(model: Description) -> tuple[Shape, ...]:
    """The shapes of a model. The ground of a wheel is the one it rolls on, not that on which its center moves."""
    wheels = [word for word in model.constraints if isinstance(word, Rolling)]
    found: list[tuple[Plane | Surface, dict[str, str], str]] = []
    for ground, contacts, name in _grounds(model.constraints, wheels):
        same = next((each for each in found if each[0] == ground), None)
        if same is None:
            same = (ground, {}, name)
            found.append(same)
        same[1].update(contacts)
    grounds = [_ground(ground, name, contacts) for ground, contacts, name in found]
    rolling = [Shape("wheel", wheel.name, place=wheel.center.full_name) for wheel in wheels if not wheel.ball]
    rolling += [Shape("wheel", center, place=center) for center in _arcs(model)]
    rolling += _round_feet(model)
    edges = [
        Shape("blade", word.name, place=word.frame.full_name)
        for word in model.constraints
        if isinstance(word, KnifeEdge)
    ]
    held = [Shape("held", name, place=frame.full_name, form=form) for name, frame, form in held_contacts(model)]
    return (*grounds, *rolling, *edges, *held)


def _grounds(
    words: Iterable[Constraint], wheels: list[Rolling]
) -> Iterable[tuple[Plane | Surface, dict[str, str], str]]:
    """(ground, the frame that touches it of a contact that opens and closes, name of the constraint)."""
    for word in words:
        measure = getattr(word, "measure", None)
        ground = getattr(measure, "ground", None)
        if isinstance(ground, Plane | Surface):
            point = _point(measure)
            tread = next((wheel for wheel in wheels if wheel.center == point and _carries(wheel, ground)), None)
            contacts = {} if word.kind == "bilateral" else {word.name: point.full_name}
            yield (tread.ground, contacts, tread.name) if tread else (ground, contacts, word.name)
    for wheel in wheels:
        yield wheel.ground, {}, wheel.name


def _point(measure: Any) -> Frame:
    """The frame that stands for where it touches: of a round foot its center, of a sole its origin."""
    found: Frame = next(getattr(measure, name) for name in ("point", "center", "frame") if hasattr(measure, name))
    return found


def _round_feet(model: Description) -> list[Shape]:
    """Disks and balls that touch, with their contacts, by the names of their centers; without those that only roll."""
    found: dict[str, tuple[str, list[str]]] = {}
    for word in model.constraints:
        measure = getattr(word, "measure", None)
        if isinstance(measure, DiskTouchdown | SphereTouchdown):
            kind = "wheel" if isinstance(measure, DiskTouchdown) else "ball"
            contacts = found.setdefault(measure.center.full_name, (kind, []))[1]
            contacts += [] if word.kind == "bilateral" else [word.name]
            if isinstance(measure.ground, Ball) and not measure.ground.hollow:
                found.setdefault(measure.ground.center.full_name, ("ball", []))
    rolling = {word.center.full_name for word in model.constraints if isinstance(word, Rolling) and not word.ball}
    return [
        Shape(kind, center, tuple(contacts), (center,) * len(contacts), center)
        for center, (kind, contacts) in found.items()
        if center not in rolling or contacts
    ]


def _arcs(model: Description) -> dict[str, Frame]:
    """Centers of round feet by full name."""
    measures = (getattr(word, "measure", None) for word in model.constraints)
    return {each.center.full_name: each.center for each in measures if isinstance(each, RollingTouchdown)}


def _carries(wheel: Rolling, ground: Plane | Surface) -> bool:
    """Whether the center moves on a ground that is the wheel's own one, a radius higher."""
    own = wheel.ground
    if not isinstance(ground, Plane) or ground.frame != own.frame:
        return False
    return max(abs(a - b) for a, b in zip(ground.normal, own.normal, strict=True)) < 1e-12


def _ground(ground: Plane | Surface, name: str, touching: dict[str, str]) -> Shape:
    contacts, points = tuple(touching), tuple(touching.values())
    if isinstance(ground, Surface):
        return Shape("surface", name, contacts, points, across="".join(ground.arguments))
    if ground.is_moving:
        return Shape("moving plane", name, contacts, points)
    return Shape("plane", name, contacts, points, numbers=(*ground.normal, ground.offset))


def offer_shapes(outputs: Outputs, scope: Scope, model: Description) -> None:
    """What moves of the shapes, as results that are not listed."""

    def offer(owner: str, what: str, make: Callable[[], Triple]) -> None:
        outputs.triple(drawn(owner, what), make, AXES, listed=False)

    offer_held(offer, scope, model)
    for name, center in _arcs(model).items():
        offer(name, "spoke", partial(_axis, scope, center, (0.0, -1.0, 0.0)))
        offer(name, "axle", partial(_axis, scope, center, (0.0, 0.0, 1.0)))
    for word in model.constraints:
        measure = getattr(word, "measure", None)
        if isinstance(measure, DiskTouchdown | SphereTouchdown):
            offer(word.name, "arm", partial(_arm, scope, measure))
        if isinstance(measure, DiskTouchdown):
            _offer_wheel(offer, scope, measure.center.full_name, measure.center, measure.axis)
        if isinstance(word, Rolling):
            _offer_plane(offer, scope, word.name, word.ground)
            _offer_wheel(offer, scope, word.name, word.center, (0.0, 0.0, 1.0) if word.axis is None else word.axis)
        elif isinstance(word, KnifeEdge):
            offer(word.name, "along", partial(_axis, scope, word.frame, _along(word.normal)))
        elif measure is not None and isinstance(getattr(measure, "ground", None), Plane):
            _offer_plane(offer, scope, word.name, measure.ground)
        elif measure is not None and isinstance(getattr(measure, "ground", None), Surface):
            outputs.add(drawn(word.name, HEIGHT), partial(_height, scope, measure.ground), listed=False)
            for k, way in enumerate(("normal", "forward", "sideways")):
                offer(word.name, way, partial(_slope, scope, measure, k))


def _offer_plane(
    offer: Callable[[str, str, Callable[[], Triple]], None], scope: Scope, name: str, plane: Plane
) -> None:
    if plane.is_moving:
        offer(name, "place", partial(_material, scope, plane))
        offer(name, "normal", lambda: plane.turned(plane.normal, scope))
        for k, way in enumerate(("forward", "sideways")):
            offer(name, way, partial(plane.turned, plane.along[k], scope))


def _material(scope: Scope, plane: Plane) -> Triple:
    """The material point of the plane nearest to the frame's origin as time was 0, ``p_F + R_F (d n + u t)``."""
    place = total(scaled(plane.offset, plane.normal), scaled(scope.time, plane.velocity))
    return place if plane.frame is None else total(scope.frame(plane.frame).position, plane.turned(place, scope))


def _offer_wheel(offer: Offer, scope: Scope, name: str, center: Frame, axle: Vector3) -> None:
    offer(name, "spoke", partial(_axis, scope, center, basis(axle)[0]))
    offer(name, "axle", partial(_axis, scope, center, axle))


def _arm(scope: Scope, measure: DiskTouchdown | SphereTouchdown) -> Triple:
    """From the center to the point nearest to the ground."""
    return measure.edge_arm(scope) if isinstance(measure, DiskTouchdown) else measure.arm(scope)


def _axis(scope: Scope, frame: Frame, direction: Triple) -> Triple:
    """A direction of a frame in ground axes."""
    return rotate(scope.frame(frame).rotation, direction)


def _along(normal: tuple[float, float, float]) -> Triple:
    """Along a blade: across its normal, in the x-y plane of the frame where it can be."""
    x, y, _ = normal
    size = (x * x + y * y) ** 0.5
    return (y / size, -x / size, 0.0) if size > 1e-9 else (1.0, 0.0, 0.0)


def _height(scope: Scope, surface: Surface) -> Scalar:
    """y = H at the inputs PLACE."""
    tape = scope.tape
    return surface.slopes((tape.input(PLACE, 0), 0.0, tape.input(PLACE, 1)), scope)[0]


def _slope(scope: Scope, measure: Any, k: int) -> Triple:
    """Normal of a surface where something touches, or the direction forward or sideways along it."""
    place = scope.frame(_point(measure)).position
    if isinstance(measure, DiskTouchdown | SphereTouchdown):
        place = total(place, _arm(scope, measure))
    found: Triple = measure.ground.normal_at(place, scope) if k == 0 else measure.ground.directions(place, scope)[k - 1]
    return found
