"""A foot with an elastic keel."""

from dataclasses import replace
from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.inertia import rod
from mbd.bodies.rigid_body import RigidBody
from mbd.constraints.unilateral import Unilateral
from mbd.joints.losses.base import Loss
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import between, check, sizes
from mbd.parts.feet.heel_and_toe import heel_and_toe
from mbd.topology.description import Description


def keel_foot(
    model: Description, name: str, heel: Frame, root: Frame, *, length: float, stiffness: float, mass: float,
    loss: Loss | None = None, release: Any = None,
    only_while: Any = None, friction: float | None = None, ground: Any = None,
) -> tuple[Unilateral, Unilateral]:  # fmt: skip
    """A blade spring clamped at its root, whose end is the toe: a rigid link of γ l on a torsion spring.

    ``K = k (γ l)²`` with the stiffness k of the toe against force across the blade, as test benches measure it (for a
    uniform blade ``k = 3 E I/l³``), γ = 0.85. Passive. L. L. Howell & A. Midha, Parametric deflection approximations
    for end-loaded, large-deflection beams in compliant mechanisms, J. Mech. Design 117 (1995) 156: the end's path is
    right to 0.5 % up to a slope of about 60°.

    A rigid heel beside a light blade may strike such that no forces let both points push; a run ends there and says
    so. With a `Penalty` at the heel, a cushion, the walk continues.

    The blade's bending is the joint '<name> keel', the contacts are '<name> heel' and '<name> toe'.

    Parameters
    ----------
    model, name : the model, and the name that everything begins with
    heel : a point of the body that carries the blade
    root : where the blade is clamped, a frame of that body; the blade lies along its x axis
    length : l of the blade [m]
    stiffness : k at the toe [N/m]
    mass : of the part that turns, a uniform rod [kg]
    loss : hysteresis of the blade, such as Viscous(0.5)
    release, only_while, friction, ground : as of `heel_and_toe`

    >>> import mbd
    >>> model, shank = mbd.Model("leg"), mbd.Link("shank", mass=2.0, length=0.4, center=0.2)
    >>> model.connect(mbd.Planar("body", model.ground.origin, shank.start))
    >>> how = {"length": 0.2, "stiffness": 4e4, "mass": 0.2, "loss": mbd.Viscous(0.5)}
    >>> heel, toe = mbd.parts.keel_foot(model, "left", shank.point(-0.05, -0.45), shank.point(0.0, -0.45), **how)
    >>> model.check(), round(model.parameters["left keel spring.stiffness"])
    ([], 1156)
    """  # fmt: skip
    check(model, name, "keel_foot")
    between("keel_foot", name, heel=heel, root=root)
    span, k, m = sizes(f"keel_foot '{name}'", length=length, stiffness=stiffness, mass=mass)
    # γ, the share of a blade's length that turns as a rigid link, for loads across it (Howell & Midha 1995)
    reach = 0.85 * span
    solid = rod(m, reach)
    across, along, _ = solid.inertia
    blade = RigidBody(f"{name} blade", m, (along, across, across), center=(0.5 * reach, 0.0, 0.0))
    x_axis = (1.0, 0.0, 0.0) if root.rotation is None else tuple(row[0] for row in root.rotation)
    x, y, z = (place + (span - reach) * along for place, along in zip(root.offset, x_axis, strict=True))
    hinge = replace(root, name=f"{name} keel", offset=(x, y, z), landmark=None)
    model.connect(Revolute(f"{name} keel", hinge, blade.origin, loss=loss, stiffness=k * reach * reach))
    toe = blade.point(reach, 0.0, name="toe")
    return heel_and_toe(
        model, name, heel, toe, release=release, only_while=only_while, friction=friction, ground=ground
    )
