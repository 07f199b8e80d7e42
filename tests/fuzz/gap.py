"""Gaps and the directions along which their forces act."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.fuzz.bodies import Bodies
from tests.fuzz.geometry import Array


@dataclass
class Gap:
    """A measure g along a motion, and the generalized direction ∂g: forces on points, efforts on joints.

    value : g (n,)
    points : (body, place (n, 3), direction (n, 3)): a force p acts as p · direction at this place of the body
    efforts : (joint, place of the coordinate, factor (n,))
    drift : ∂g/∂t (n,), of surfaces that move by themselves
    tangents : (name of the part, direction (n, 3)) along which a point can stick or rub
    carried : velocity at which a surface runs along by itself (n, 3)
    blur : 1/r, where round-off of a rotation makes 1/r² times itself of g, and 1/r³ of ġ (n,)
    """

    value: Array
    points: list[tuple[str, Array, Array]]
    efforts: list[tuple[str, int, Array]]
    drift: Array
    tangents: list[tuple[str, Array]]
    carried: Any = 0.0
    blur: Any = 0.0

    def rate(self, bodies: Bodies) -> Array:
        """ġ from the motion of the bodies."""
        found = np.array(self.drift, dtype=float)
        for body, place, direction in self.points:
            found = found + np.sum(direction * bodies.velocity(body, place), axis=1)
        joints = {joint.name: joint for joint in bodies.model.joints}
        for name, k, factor in self.efforts:
            found = found + factor * bodies.told[joints[name].velocity_names[k]]
        return found

    def slip(self, bodies: Bodies) -> Array:
        """Velocity of the point against the surface (n, 3)."""
        (body, place, _), *carriers = self.points
        v = bodies.velocity(body, place) - self.carried
        for carrier, _, _ in carriers:
            v = v - bodies.velocity(carrier, place)
        return np.asarray(v)
