"""Losses: what a joint takes out of the motion."""

from mbd.joints.losses.affine_friction import AffineFriction
from mbd.joints.losses.base import DissipationFunction, Loss, LossSum
from mbd.joints.losses.compressible_damper import CompressibleDamper
from mbd.joints.losses.coulomb import Coulomb
from mbd.joints.losses.dahl import Dahl
from mbd.joints.losses.dissipation import Dissipation
from mbd.joints.losses.lugre import LuGre
from mbd.joints.losses.pin_friction import PinFriction
from mbd.joints.losses.quadratic import Quadratic
from mbd.joints.losses.stribeck import Stribeck
from mbd.joints.losses.tabulated import Tabulated
from mbd.joints.losses.valves import Valves
from mbd.joints.losses.viscous import Viscous

__all__ = [
    "AffineFriction", "CompressibleDamper", "Coulomb", "Dahl", "Dissipation", "DissipationFunction", "Loss", "LossSum",
    "LuGre", "PinFriction", "Quadratic", "Stribeck", "Tabulated", "Valves", "Viscous",
]  # fmt: skip
