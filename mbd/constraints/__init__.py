"""Constraints: where (measures), what law, and when."""

from mbd.constraints.balls import Ball
from mbd.constraints.base import Constraint, VelocityConstraint
from mbd.constraints.bilateral import Bilateral
from mbd.constraints.bristles import Bristles
from mbd.constraints.controller import Controller
from mbd.constraints.disks import disk_touchdown
from mbd.constraints.event import Event
from mbd.constraints.hysteretic_stop import HystereticStop
from mbd.constraints.impulse import Impulse
from mbd.constraints.knife_edge import KnifeEdge
from mbd.constraints.law import Closing, Drag, Equation, Law
from mbd.constraints.maxwell_stop import MaxwellStop
from mbd.constraints.measure import Measure
from mbd.constraints.measures import distance, extension, flexion, height, separation
from mbd.constraints.mode import Mode, Transition
from mbd.constraints.nonholonomic import Nonholonomic
from mbd.constraints.penalty import Penalty
from mbd.constraints.penalty_parameters import PenaltyParameters, penalty_parameters
from mbd.constraints.rolling import Rolling
from mbd.constraints.rolling_touchdown import profile_touchdown, rolling_touchdown
from mbd.constraints.rules import When
from mbd.constraints.sampled_law import SampledLaw
from mbd.constraints.sphere_touchdown import sphere_touchdown
from mbd.constraints.spring_leg import SpringLeg
from mbd.constraints.surfaces import Plane
from mbd.constraints.touchdown import touchdown
from mbd.constraints.turning_measures import cone, twist
from mbd.constraints.unilateral import Unilateral
from mbd.constraints.user_measure import measure

__all__ = [
    "Ball", "Bilateral", "Bristles", "Closing", "Constraint", "Controller", "Drag", "Equation", "Event",
    "HystereticStop", "Impulse", "KnifeEdge", "Law", "MaxwellStop", "Measure", "Mode", "Nonholonomic", "Penalty",
    "PenaltyParameters", "Plane", "Rolling", "SampledLaw", "SpringLeg", "Transition", "Unilateral",
    "VelocityConstraint", "When", "cone", "disk_touchdown", "distance", "extension", "flexion", "height", "measure",
    "penalty_parameters", "profile_touchdown", "rolling_touchdown", "separation", "sphere_touchdown", "touchdown",
    "twist",
]  # fmt: skip
