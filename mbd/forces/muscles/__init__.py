"""Muscles: curves of force, paths over joints, activation and contraction."""

from mbd.forces.muscles.muscle import Muscle
from mbd.forces.muscles.paths import PolynomialPath, ViaPoint
from mbd.forces.muscles.wrapping import WrappingCylinder, WrappingEllipsoid, WrappingSphere

__all__ = ["Muscle", "PolynomialPath", "ViaPoint", "WrappingCylinder", "WrappingEllipsoid", "WrappingSphere"]
