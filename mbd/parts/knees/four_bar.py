"""A polycentric knee: the four-bar linkage of the 3R60, with its hydraulic units."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.rigid_body import RigidBody
from mbd.constraints.measure import Measure
from mbd.constraints.user_measure import measure
from mbd.forces.damper import Damper
from mbd.forces.spring import Spring
from mbd.joints.losses.affine_friction import AffineFriction
from mbd.joints.losses.base import Loss
from mbd.joints.losses.valves import Valves
from mbd.joints.revolute import Revolute
from mbd.joints.weld import Weld
from mbd.parts.arguments import Stop, between, check, constrain_stop
from mbd.topology.description import Description

PIVOTS_3R60: dict[str, tuple[float, float]] = {
    "shank": (0.0, 0.0),
    "front lower": (0.0273480, 0.0841685),
    "rear lower": (-0.0128040, 0.0813608),
    "rear middle": (-0.0178379, 0.0874493),
    "swing lower": (0.0126744, 0.0867559),
    "front upper": (-0.0058519, 0.1731784),
    "rear upper": (-0.0299587, 0.1634387),
    "swing upper": (-0.0228662, 0.1682996),
    "thigh": (-0.0014933, 0.1978971),
}
"""Pivots of the straight, unloaded knee in axes of the shank, from where its tube begins: x forward, y up [m].

They are laid out from the lengths and angles of the links (88.5, 40.25, 14.9, 95, 7.9, 76.95, 26, 17.7, 25.1 mm; 18°,
−112°, −98°, 116°, 122°, −10°) of a public model of an amputee's gait (amputee_gait_simulation, with an M.Sc. thesis at
TU Delft, 2020), such that the stance spring has its free length, 89.25 mm; that of swing then has 88.95 of 89.6 mm and
presses the knee straight. The table leaves open on which side of its dead center the rocker stands; here it is the one
to which the stop of that model leads. Masses and inertias of the links are those of the same constants; the cylinders,
143.8 and 89.6 g, are left out.
"""

HEIGHT_3R60 = PIVOTS_3R60["thigh"][1]
"""From the shank's tube to the thigh's, of the straight knee [m]."""

SMOOTHING = 1e-4
"""Speed over which the friction of the units sets in, below the slowest of the tests, 20 mm/min = 0.33 mm/s [m/s]."""

SWING_3R60 = Valves(
    backward=AffineFriction(213.5932, -4927.5, SMOOTHING), forward=AffineFriction(146.3288, -8808.5, SMOOTHING)
)
"""Of the swing unit, told as ``213.5932/|v| − 4927.5`` in flexion and ``146.3288/|v| − 8808.5`` N s/m in extension.

Both were fitted between 0.33 and 3.3 mm/s (tests at 20 to 200 mm/min, constants of the same public model). They turn
negative above 43.3 and 16.6 mm/s, where a damper would drive: from there on this friction is 0.
"""

STANCE_3R60 = Valves(
    backward=AffineFriction(2.1443, 885.0653, SMOOTHING), forward=AffineFriction(7.0819, 65579.0, SMOOTHING)
)
"""Of the stance unit, told as ``2.1443/|v| + 885.07`` as it yields and ``7.0819/|v| + 65579`` N s/m coming back."""

LINKS: dict[str, tuple[float, float, str, str, float]] = {
    "front bar": (0.1238, 1.18e-4, "front lower", "front upper", 0.5),
    "rocker": (0.0495, 4.13e-6, "rear lower", "rear middle", 0.5),
    "rear bar": (0.0583, 3.59e-5, "rear middle", "rear upper", 5.45 / 11.05),
    "base": (0.2533, 2.596e-4, "shank", "front lower", 3.6 / 10.4),
    "head": (0.1966, 6.86e-5, "front upper", "thigh", 0.5),
}
"""Mass [kg], inertia [kg m²], pivot of its axes, and a pivot towards which its center lies, at a share of the way."""


def four_bar_knee(
    model: Description, name: str, thigh: Frame, shank: Frame, *, swing: Loss = SWING_3R60, stance: Loss = STANCE_3R60,
    stop: Stop = None, loss: Loss | None = None,
) -> Measure:  # fmt: skip
    """The 3R60: a four-bar linkage whose rear bar stands on a rocker, with hydraulic units for swing and for stance.

    A five-bar linkage with two freedoms. The swing unit (18.75 kN/m and its damper) shortens as the knee bends; the
    stance unit (130 kN/m and its damper) lets the rocker yield under load by some degrees without the knee's giving
    way. Passive. Links, masses, springs and damper laws: see `PIVOTS_3R60` and `SWING_3R60`. What polycentric knees do:
    C. W. Radcliffe, Four-bar linkage prosthetic knee mechanisms, Prosthetics and Orthotics International 18 (1994) 159.

    Its bodies and joints are called '<name> front bar', '<name> front lower' and so on, its springs '<name> swing
    spring' and '<name> stance spring', its dampers '<name> swing damper' and '<name> stance damper', its flexion
    '<name> flexion'. All angles of its joints are 0 where it is straight.

    Parameters
    ----------
    model, name : the model, and the name that everything begins with
    thigh : frame at the thigh's end, whose y axis points up the thigh
    shank : frame at the shank's beginning, `HEIGHT_3R60` below it as the leg is straight
    swing, stance : losses of the units, of their speed along the line [m/s]; shortening is backwards
    stop : arguments of the `Penalty` at full extension [N m/rad]; None: none
    loss : of each pivot

    Returns
    -------
    The angle of flexion, 0 where it is straight [rad]; `flexion` ≥ 0 as for a single axis.

    >>> import mbd
    >>> thigh = mbd.Link("thigh", mass=7.0, length=0.3, center=0.15, inertia=0.1)
    >>> model, shank = mbd.Model("leg"), mbd.Link("shank", mass=1.0, length=0.3, center=0.15, inertia=0.03)
    >>> model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start))
    >>> rubber = {"stiffness": 2000.0, "damping": 10.0}
    >>> bend = mbd.parts.four_bar_knee(model, "knee", thigh.end, shank.start, stop=rubber)
    >>> model.check(), [force.name for force in model.forces]
    ([], ['knee swing spring', 'knee swing damper', 'knee stance spring', 'knee stance damper'])
    """  # fmt: skip
    check(model, name, "four_bar_knee")
    between("four_bar_knee", name, thigh=thigh, shank=shank)
    bodies = {link: _body(name, link) for link in LINKS}
    pins = {
        "front lower": ("base", "front bar"), "front upper": ("front bar", "head"), "rear lower": ("base", "rocker"),
        "rear middle": ("rocker", "rear bar"), "rear upper": ("rear bar", "head"),
    }  # fmt: skip
    joints = {
        pin: Revolute(f"{name} {pin}", _at(bodies[a], a, pin), _at(bodies[b], b, pin), loss=loss)
        for pin, (a, b) in pins.items()
    }
    model.connect(
        Weld(f"{name} thigh clamp", thigh, _at(bodies["head"], "head", "thigh")),
        Weld(f"{name} shank clamp", _at(bodies["base"], "base", "shank"), shank),
        *joints.values(),
    )
    ends = {"swing": ("swing lower", "head", "swing upper"), "stance": ("shank", "rocker", "rear middle")}
    for unit, stiffness, length, damping in (("swing", 18750.0, 0.0896, swing), ("stance", 130000.0, 0.08925, stance)):
        low, body, high = ends[unit]
        line = _at(bodies["base"], "base", low), _at(bodies[body], body, high)
        model.apply(
            Spring(f"{name} {unit} spring", *line, stiffness, length), Damper(f"{name} {unit} damper", *line, damping)
        )
    bend = measure(_sum, joints["front lower"], joints["front upper"], unit="rad")
    model.observe(f"{name} flexion", bend)
    if stop is not None:
        constrain_stop(model, name, bend, stop)
    return bend


def _sum(lower: Any, upper: Any) -> Any:
    """Flexion: how far the thigh has turned back against the shank."""
    return lower + upper


def _body(name: str, link: str) -> RigidBody:
    mass, inertia, start, towards, share = LINKS[link]
    (xa, ya), (xb, yb) = PIVOTS_3R60[start], PIVOTS_3R60[towards]
    return RigidBody(f"{name} {link}", mass, inertia, center=(share * (xb - xa), share * (yb - ya), 0.0))


def _at(body: RigidBody, link: str, pivot: str) -> Frame:
    """A pivot on a link, whose axes begin in its own."""
    (xa, ya), (xb, yb) = PIVOTS_3R60[LINKS[link][2]], PIVOTS_3R60[pivot]
    return body.origin if (xa, ya) == (xb, yb) else body.point(xb - xa, yb - ya, name=pivot)
