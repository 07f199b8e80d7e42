"""What results need to know about a model besides numbers; kept in files, so that a loaded run can do without it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from functools import cached_property
from typing import Any

import numpy as np

from mbd.dataclass import dataclass
from mbd.equations.equations import Equations
from mbd.equations.held import WAYS
from mbd.equations.net_moments import contact_places
from mbd.equations.shapes import HEIGHT, Shape, drawn
from mbd.joints.anatomy import Angle, angles_of
from mbd.results.names import AXES

ROUND = ("wheel", "ball")
"""Kinds of shapes that have a radius."""


@dataclass(frozen=True)
class ContactFacts:
    """A contact.

    kind : 'unilateral' or 'penalty'; unit : of its gap; place : the frame that touches ('left shank.end'), '' for a
    contact without one such as a knee stop
    """

    name: str
    kind: str
    unit: str
    place: str = ""


@dataclass(frozen=True)
class Facts:
    """Names and units of a model.

    coordinates : (name, unit) of the coordinates and of the first-order states
    coordinate_count : how many of them belong to q
    contacts : in the order of the columns of `closed`
    segments : (body, (frame, …)) lines of the stick figure, whose points are the results 'body.frame'
    frictions : (name, unit) of the dry frictions of joints, 'N' or 'N m'
    velocities : (name, unit) of velocities that are not the rates of coordinates
    markers : full names of the named points, 'left shank.toe' or 'heel'
    observations : (name, unit) of the results of users' own
    shapes : grounds, wheels, blades, and in space solids and hinges, that pictures show
    anatomy : (joint, 'left hip') of joints of the body, whose angles are named
    mirror : (name, sign) of coordinates and velocities in space in its mirror image, that exchanges left and right
    modes : (name, (state, …)) of discrete states, whose results are these texts
    """

    model: str = ""
    coordinates: tuple[tuple[str, str], ...] = ()
    coordinate_count: int = 0
    contacts: tuple[ContactFacts, ...] = ()
    segments: tuple[tuple[str, tuple[str, ...]], ...] = ()
    frictions: tuple[tuple[str, str], ...] = ()
    velocities: tuple[tuple[str, str], ...] = ()
    markers: tuple[str, ...] = ()
    observations: tuple[tuple[str, str], ...] = ()
    shapes: tuple[Shape, ...] = ()
    anatomy: tuple[tuple[str, str], ...] = ()
    mirror: tuple[tuple[str, float], ...] = ()
    modes: tuple[tuple[str, tuple[str, ...]], ...] = ()

    @property
    def rates(self) -> tuple[str, ...]:
        """Names that velocities may have: rates of coordinates, not all of which there are, and `velocities`."""
        return (*(f"{name}.rate" for name, _ in self.coordinates[: self.coordinate_count]), *dict(self.velocities))

    @cached_property
    def angles(self) -> dict[str, Angle]:
        """Named angles of joints of the body by full name, 'left hip.flexion'."""
        return {
            f"{joint}.{angle.name}": angle
            for joint, part in self.anatomy
            for angles, _ in angles_of(part)
            for angle in angles
        }

    def worded(self, name: str, values: Any) -> Any:
        """The texts of a discrete state in place of its numbers; other results as they are."""
        states = dict(self.modes).get(name)
        return values if states is None else np.asarray(states)[np.asarray(values).astype(int)]

    @property
    def drawn(self) -> tuple[str, ...]:
        """Results that only pictures ask for, besides heights."""
        found: list[str] = []
        for shape in self.shapes:
            vectors = {
                "moving plane": ("place", "normal", "forward"), "wheel": ("spoke", "axle"), "blade": ("along",),
                "solid": ("first", "second"), "limb": (), "hinge": ("axis",), "cone": ("axis",), "held": WAYS,
            }.get(shape.kind, ())  # fmt: skip
            found += [drawn(shape.name, what) for what in vectors]
            if shape.kind in ("moving plane", "surface"):
                found += [
                    drawn(contact, what) for contact in shape.contacts for what in ("normal", "forward", "sideways")
                ]
            if shape.kind in ROUND:
                found += [drawn(contact, "arm") for contact in shape.contacts]
        radii = (f"{shape.name}.radius" for shape in self.shapes if shape.kind in ROUND)
        return (*dict.fromkeys(name + axis for name in found for axis in AXES), *radii)

    @property
    def heights(self) -> tuple[str, ...]:
        """Names of the heights of surfaces, which depend on a place."""
        return tuple(drawn(shape.name, HEIGHT) for shape in self.shapes if shape.kind == "surface")

    @classmethod
    def of(cls, equations: Equations) -> Facts:
        """The facts of a set of equations."""
        figure = equations.figure() if equations.figure is not None else ()
        return cls(
            equations.name,
            tuple((c.name, c.unit) for c in (*equations.coordinates, *equations.states)),
            equations.n_q,
            tuple(
                ContactFacts(contact.name, contact.kind, contact.unit, place)
                for contact, place in zip(equations.contacts, contact_places(equations), strict=True)
            ),
            tuple((body, tuple(frames)) for body, frames in figure if body != "ground"),
            tuple(
                (name, "N m" if equations.rows[friction.row].unit == "rad" else "N")
                for friction in equations.frictions
                if friction.contact < 0
                for name in dict.fromkeys((friction.name, equations.rows[friction.row].owner))
            ),
            _own_velocities(equations),
            equations.markers,
            equations.observations,
            equations.shapes,
            equations.anatomy,
            tuple(equations.mirror().items()) if equations.mirror is not None else (),
            tuple(
                (each.name, each.states)
                for each in equations.machines
                if len(each.states) > 1 and each.name in equations.output_names()  # a sampled law only waits
            ),
        )

    @classmethod
    def read(cls, data: Mapping[str, Any]) -> Facts:
        """The facts from what `as_json` gave."""
        return cls(
            data["model"],
            tuple((name, unit) for name, unit in data["coordinates"]),
            data["coordinate_count"],
            tuple(ContactFacts(**contact) for contact in data["contacts"]),
            tuple((body, tuple(frames)) for body, frames in data["segments"]),
            tuple((name, unit) for name, unit in data.get("frictions", ())),
            tuple((name, unit) for name, unit in data.get("velocities", ())),
            tuple(data.get("markers", ())),
            tuple((name, unit) for name, unit in data.get("observations", ())),
            tuple(_shape(shape) for shape in data.get("shapes", ())),
            tuple((joint, part) for joint, part in data.get("anatomy", ())),
            tuple((name, float(sign)) for name, sign in data.get("mirror", ())),
            tuple((name, tuple(states)) for name, states in data.get("modes", ())),
        )

    def as_json(self) -> dict[str, Any]:
        """Plain lists and dictionaries."""
        return asdict(self)


def _shape(data: Mapping[str, Any]) -> Shape:
    return Shape(**{**data, **{name: tuple(data[name]) for name in ("contacts", "points", "numbers")}})


def _own_velocities(equations: Equations) -> tuple[tuple[str, str], ...]:
    """(name, unit) of velocities of joints whose coordinates do not add."""
    whole = equations.configuration
    pairs = zip(whole.places, whole.velocity_names, whole.velocity_units, strict=True)
    return tuple((name, unit) for place, name, unit in pairs if place < 0)
