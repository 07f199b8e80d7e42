"""Constraints: where (measures), what law, and when."""

from mbd.constraints.base import Constraint, Measure
from mbd.constraints.bilateral import Bilateral
from mbd.constraints.controller import Controller
from mbd.constraints.event import Event
from mbd.constraints.measures import distance, extension, flexion, height, separation
from mbd.constraints.penalty import Penalty
from mbd.constraints.rules import When
from mbd.constraints.touchdown import Plane, touchdown
from mbd.constraints.unilateral import Unilateral
from mbd.constraints.user_measure import measure

__all__ = [
    "Bilateral", "Constraint", "Controller", "Event", "Measure", "Penalty", "Plane", "Unilateral", "When", "distance",
    "extension", "flexion", "height", "measure", "separation", "touchdown",
]  # fmt: skip
