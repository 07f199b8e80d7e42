"""Bodies and the frames on them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Protocol

from mbd.bodies.algebra import IDENTITY, Rotation, Triple, constant_rotation, product
from mbd.bodies.domains import Domain, Parameterized, at_least_zero
from mbd.bodies.mass import MassProperties
from mbd.bodies.values import Vector3, number, printable, triple, unit_vector
from mbd.dataclass import dataclass
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.tape.node import Node, Scalar

Parameter = Callable[[str], Scalar]
"""Gives the value of a field of a body, a number or a run-time input."""


class ParameterSource(Protocol):
    """What bodies ask of a `Scope`."""

    def parameter(self, owner: str, field: str, value: float) -> Node:
        """The run-time input named ``owner.field``; an exact 0 or ±1 is structural and folds, unless tunable."""


class Body(Parameterized, ABC):
    """Something that moves as a whole, with named frames; a body's axes lie in its `origin` frame.

    A new kind of body is a frozen dataclass with a `name`, its `fields`, its `landmarks` and its mass.
    """

    @abstractmethod
    def fields(self) -> dict[str, float]:
        """Its physical quantities by field: {'mass': 0.5, 'length': 0.4, …}; each is a run-time parameter."""

    @abstractmethod
    def landmarks(self, parameter: Parameter) -> dict[str, Triple]:
        """Positions of its own frames in body axes [m], from its fields."""

    @abstractmethod
    def mass_properties(self, scope: ParameterSource) -> MassProperties:
        """Mass, center and inertia as run-time scalars."""

    def domains(self) -> dict[str, Domain]:
        """A mass ≥ 0; any other field may have any finite value."""
        return (
            {f"{self.name}.mass": at_least_zero("is negative; give a mass ≥ 0", "kg")}
            if "mass" in self.fields()
            else {}
        )

    @property
    def known_as(self) -> str:
        """ "body 'left thigh'"."""
        return f"body '{self.name}'"

    def parameter(self, scope: ParameterSource) -> Parameter:
        """The run-time inputs of its fields."""
        values = self.fields()
        return lambda field: scope.parameter(self.name, field, values[field])

    def parameters(self) -> dict[str, float]:
        """Run-time parameters by full name: {'left thigh.mass': 0.5, …}."""
        return {f"{self.name}.{field}": value for field, value in self.fields().items()}

    @property
    def frames(self) -> dict[str, Frame]:
        """Its own frames by name."""
        places = self.landmarks(self.fields().__getitem__)
        return {name: self._own_frame(name, place) for name, place in places.items()}

    def _own_frame(self, name: str, place: Triple) -> Frame:
        return Frame(self, name, triple(place, name), landmark=name)

    def frame(self, name: str) -> Frame:
        """One of its own frames, 'origin', 'center', …, or a named point that was made on it: 'toe'."""
        places = self.landmarks(self.fields().__getitem__)
        if name in places:
            return self._own_frame(name, places[name])
        points = {point.name: point for point in self.points.values()}
        if name not in points:
            raise ModelError(f"body '{self.name}': " + nearest(name, {**points, **places}, "frame", "The body has"))
        return points[name]

    @property
    def origin(self) -> Frame:
        """The frame in which the body is described."""
        return self.frame("origin")

    @property
    def center(self) -> Frame:
        """The frame at the center of mass."""
        return self.frame("center")

    @property
    def points(self) -> dict[str, Frame]:
        """The named points that were made on this body, by full name: results of every model that has the body."""
        return dict(self.__dict__.get("_points", {}))

    def remember(self, frame: Frame) -> Frame:
        """Keep a named point, so that results have it though nothing else uses it; of two of one name the last.

        One that is there already is given back. It is no part of the body's description: equality, replacement and
        the equations of motion do not ask for it.
        """
        known = self.points
        if known.get(frame.full_name) != frame:
            object.__setattr__(self, "_points", {**known, frame.full_name: frame})
        return self.points[frame.full_name]

    def point(self, x: float, y: float, z: float = 0.0, name: str | None = None) -> Frame:
        """A frame at a point of the body, parallel to its axes.

        Its coordinates are run-time parameters 'body.name.x', …; without a name they make the name. A named one is
        always among the results, and on the page, though nothing uses it.

        Parameters
        ----------
        x, y, z : place in body axes [m]
        name : such as 'toe', by which results are asked for: 'left foot.toe.y'
        """
        offset = triple((x, y, z), f"a point of '{self.name}'")
        if name is None:
            name = f"point({offset[0]:.12g}, {offset[1]:.12g}, {offset[2]:.12g})"
        elif printable(name, f"a point of '{self.name}'") in self.frames:
            raise ModelError(f"body '{self.name}' has a frame '{name}' already; give the point another name")
        else:
            return self.remember(Frame(self, name, offset))
        return Frame(self, name, offset)


class Bodies(dict[str, "Body"]):
    """Bodies by name; the error of an unknown name offers the nearest one."""

    def __missing__(self, name: Any) -> Body:
        raise UnknownNameError(nearest(name, self, "body", "There are"))


@dataclass(frozen=True, repr=False)
class Frame:
    """A place on a body, with axes.

    Parameters
    ----------
    body : the body that carries it
    name : its name on the body; `full_name` is 'left shank.end'
    offset : its place in body axes as described [m]
    rotation : its axes as columns in body axes; None where they are the body's
    landmark : name of the body's own frame whose place it shares, None for a point with its own coordinates
    """

    body: Body
    name: str
    offset: Vector3 = (0.0, 0.0, 0.0)
    rotation: tuple[Vector3, Vector3, Vector3] | None = None
    landmark: str | None = None

    def __repr__(self) -> str:
        return f"<{self.full_name}>"

    @property
    def full_name(self) -> str:
        """'left shank.end'."""
        return f"{self.body.name}.{self.name}"

    def placement(self, scope: ParameterSource) -> tuple[Rotation, Triple]:
        """R, p of the frame in body axes at the body's origin; lengths are run-time inputs, zeros fold."""
        R: Rotation = IDENTITY if self.rotation is None else self.rotation
        if self.landmark is not None:
            return R, self.body.landmarks(self.body.parameter(scope))[self.landmark]
        x, y, z = (scope.parameter(self.full_name, f, value) for f, value in zip("xyz", self.offset, strict=True))
        return R, (x, y, z)

    def parameters(self) -> dict[str, float]:
        """Its own coordinates by full name; none for a landmark, which follows its body's fields."""
        if self.landmark is not None:
            return {}
        return {f"{self.full_name}.{field}": value for field, value in zip("xyz", self.offset, strict=True)}

    def turned(self, angle: float, axis: Any = (0.0, 0.0, 1.0), name: str | None = None) -> Frame:
        """A frame at the same place with its axes turned about an axis of this frame.

        Parameters
        ----------
        angle : right-handed about `axis` [rad]; fixed when the model is built
        axis : direction in this frame; z by default
        """
        about = unit_vector(axis, f"axis of a frame turned from '{self.full_name}'")
        turn = number(angle, f"angle of a frame turned from '{self.full_name}'")
        R: Any = product(self.rotation or IDENTITY, constant_rotation(about, turn))
        if name is None:
            return Frame(self.body, f"{self.name} turned {turn:.12g}", self.offset, R, self.landmark)
        title = printable(name, f"a frame turned from '{self.full_name}'")
        frame = Frame(self.body, title, self.offset, R, self.landmark)
        return frame if title in self.body.frames else self.body.remember(frame)

    @property
    def is_planar(self) -> bool:
        """Whether its z axis is the body's."""
        return self.rotation is None or self.rotation[2] == (0.0, 0.0, 1.0)


def frames_in_words(value: object) -> str:
    """'; its frames are .origin, .start, …' of a body that was given in place of a frame; ''."""
    return f"; its frames are {', '.join(f'.{name}' for name in value.frames)}" if isinstance(value, Body) else ""
