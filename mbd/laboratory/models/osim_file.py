"""An ``.osim`` file while it is read: what of it is known so far."""

import math
from dataclasses import field
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.base import Body, Frame
from mbd.constraints.base import Constraint
from mbd.dataclass import dataclass
from mbd.joints.base import Joint
from mbd.laboratory.models.osim_elements import plain
from mbd.laboratory.models.osim_functions import Linear
from mbd.laboratory.models.report import ImportReport
from mbd.laboratory.models.xml import Element
from mbd.model import Model


@dataclass
class OsimCoordinate:
    """A coordinate of a file."""

    name: str
    element: Element
    value: float
    low: float
    high: float
    clamped: bool
    locked: bool
    alone: bool = False
    """Whether a lock, a coupler or a stop needs it by itself."""
    free: bool = True
    """Whether no coupler determines it."""
    coupled: Any = None
    """The coupler that determines it."""
    joint: Joint | None = None
    """The joint of the model whose one coordinate it is."""

    @property
    def is_limited(self) -> bool:
        """Whether it is clamped to a range, and not locked."""
        return self.clamped and not self.locked and math.isfinite(self.low) and self.low < self.high

    @property
    def made(self) -> Joint:
        """Its joint, which is there."""
        assert self.joint is not None
        return self.joint


@dataclass
class Motion:
    """A shift along an axis or a turn about it by a function of coordinates."""

    label: str
    axis: tuple[float, float, float]
    function: Any
    coordinates: list[OsimCoordinate]

    @property
    def turns(self) -> bool:
        return self.label.startswith("rotation")

    @property
    def constant(self) -> float | None:
        """Its value where it does not move."""
        still = isinstance(self.function, Linear) and not any(self.function.slopes)
        return self.function.offset if still else None

    @property
    def is_driven(self) -> bool:
        """Whether it is ±q + offset of one coordinate."""
        function = self.function
        return isinstance(function, Linear) and len(function.slopes) == 1 and abs(self.slope) == 1.0

    @property
    def slope(self) -> float:
        """Of a function of one coordinate that is linear."""
        slope: float = self.function.slopes[0]
        return slope


@dataclass
class OsimJoint:
    """A joint of a file: its two frames as (body, place, rotation), its coordinates and motions."""

    name: str
    element: Element
    parent: tuple[str, Vector, Matrix]
    child: tuple[str, Vector, Matrix]
    coordinates: list[OsimCoordinate]
    motions: list[Motion] = field(default_factory=list)


@dataclass(eq=False)
class OsimFile:
    """The element of the model, how it is to be read, and what was read."""

    source: Element
    old: bool
    """Whether joints lie within bodies, as before the format 40000."""
    stops: bool
    repair: bool
    model: Model
    report: ImportReport = field(default_factory=ImportReport)
    bodies: dict[str, Body] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)
    held: list[Constraint] = field(default_factory=list)
    coordinates: dict[str, OsimCoordinate] = field(default_factory=dict)
    posture: dict[str, Any] = field(default_factory=dict)
    dependents: list[tuple[Joint, Motion]] = field(default_factory=list)
    """Joints of motions that are functions of coordinates."""
    measured: list[str] = field(default_factory=list)
    """Coordinates that no motion is by itself, each of a joint that carries a body without mass."""
    loops: list[tuple[str, Any, Any, Any]] = field(default_factory=list)
    """Name, kind and the two ends of joints that close loops."""
    carriers: set[str] = field(default_factory=set)
    """Names of bodies without mass."""

    def body(self, name: str) -> Body:
        """A body, or the ground."""
        return self.model.ground if name == "ground" else self.bodies[name]


def body_named(file: OsimFile, element: Element, name: str) -> str:
    name = plain(name)
    if name != "ground" and name not in file.bodies:
        raise element.wrong(f"names the body {name!r}, which the file lacks")
    return name


def body_of_socket(file: OsimFile, element: Element, path: str) -> str:
    """The body that a path of the format 40000 names: '/bodyset/pelvis', '../../ground', 'ground'."""
    *folder, last = path.split("/")
    plain = not folder or folder[-1] in ("bodyset", "..", ".", "")
    if not plain:
        raise element.wrong(f"names the frame {path!r}; bodies, and frames of the joint on bodies, are read")
    return body_named(file, element, last)


def coordinate_named(file: OsimFile, element: Element, name: str) -> OsimCoordinate:
    name = plain(name)
    if name not in file.coordinates:
        raise element.wrong(f"names the coordinate {name!r}, which the file lacks")
    return file.coordinates[name]


def framed(body: Body, joint: str, place: Vector, R: Matrix) -> Frame:
    """A frame on a body, its own axes and origin where they are those."""
    straight = np.array_equal(R, np.eye(3))
    if straight and not place.any():
        return body.origin
    x, y, z = (tuple(map(float, row)) for row in R)
    offset = tuple(map(float, place))
    return Frame(body, f"{joint} frame", offset, None if straight else (x, y, z))  # type: ignore[arg-type]
