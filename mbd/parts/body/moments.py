"""What a joint of the body resists by itself: ligaments and resting muscles."""

from typing import Any

from mbd.bodies.values import among, number
from mbd.errors import ModelError, nearest
from mbd.forces.potential import Potential
from mbd.joints.base import Joint
from mbd.parts.arguments import check
from mbd.tape.functions import exp
from mbd.topology.description import Description

PASSIVE_MOMENTS: dict[str, tuple[float, float, float, float, float, float]] = {
    "hip": (-2.44, 5.05, 1.81, 1.51, -21.88, -0.6981),
    "knee": (-6.09, 33.94, 0.13, 11.03, -11.33, -2.4),
    "ankle": (-2.03, 38.11, 0.52, 0.18, -12.12, -0.74),
}
"""k₁ [N m], k₂ [1/rad], θ₁ [rad] of the upper end of the range, and the same of the lower end.

F. C. Anderson's thesis (University of Texas at Austin, 1999), eq. 4.4 and table G.2, used in F. C. Anderson & M. G.
Pandy, Dynamic optimization of human walking, J. Biomech. Eng. 123 (2001) 381: flexion of the hip, extension of the knee
and dorsiflexion are positive. The thesis is quoted with −0.47 rad for the lower end of the hip; −0.6981 rad, 40° of
extension, is that of A. Falisse et al., J. R. Soc. Interface 16 (2019) 20190402, with their public code.
"""


def passive_moment(
    model: Description, name: str, joint: Joint, *, of: str, zero: float = 0.0, scale: float = 1.0
) -> Potential:
    """``M = k₁ exp(k₂ (q − θ₁)) + k₃ exp(k₄ (q − θ₂))``, which is small within the range and steep at its ends.

    A potential, and so passive. Moments that follow the neighbouring joints too (R. Riener & T. Edrich, Identification
    of passive elastic joint moments in the lower extremities, J. Biomechanics 32 (1999) 539) have none: joint by joint
    fitted, they would feed energy in around a closed loop.

    Parameters
    ----------
    model, name : the model, and the name of the potential
    joint : the hinge, of which hip and ankle swing forwards and the knee stretches with positive angles
    of : 'hip', 'knee' or 'ankle': see `PASSIVE_MOMENTS`
    zero : its coordinate in the anatomical posture [rad]
    scale : of the moment; the run-time parameter '<name>.scale'

    Raises
    ------
    ModelError
        for a joint that the table has not.

    >>> import mbd
    >>> model, thigh = mbd.Model("leg"), mbd.Link("thigh", mass=7.0, length=0.4, center=0.2, inertia=0.1)
    >>> hip = mbd.Revolute("left hip", model.ground.origin, thigh.start)
    >>> model.connect(hip)
    >>> mbd.parts.passive_moment(model, "left hip ligaments", hip, of="hip").parameters()
    {'left hip ligaments.scale': 1.0}
    """
    check(model, name, "passive_moment")
    if not isinstance(joint, Joint) or [label.unit for label in joint.labels] != ["rad"]:
        raise ModelError(f"joint of passive_moment '{name}' must be a hinge with one coordinate, got {joint!r}")
    if not among(of, PASSIVE_MOMENTS):
        raise ModelError(f"passive_moment '{name}': " + nearest(of, PASSIVE_MOMENTS, "joint", "The table has"))
    energy = PassiveEnergy(PASSIVE_MOMENTS[of], number(zero, f"zero of passive_moment '{name}'"))
    moment = Potential(name, energy, (joint.coordinate_names[0], ("scale", number(scale, f"scale of '{name}'"))))
    model.apply(moment)
    return moment


class PassiveEnergy:
    """V = −∫ M dq, which a process can receive."""

    def __init__(self, numbers: tuple[float, ...], zero: float) -> None:
        self.numbers, self.zero = numbers, zero

    def __call__(self, angle: Any, scale: Any) -> Any:
        k1, k2, high, k3, k4, low = self.numbers
        q = angle - self.zero
        return -scale * (k1 / k2 * exp(k2 * (q - high)) + k3 / k4 * exp(k4 * (q - low)))
