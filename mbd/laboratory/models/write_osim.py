"""Models written as ``.osim`` of the format 40000, which OpenSim 4 opens."""

import math
from collections.abc import Iterable
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from mbd.arrays import Matrix
from mbd.bodies.base import Frame
from mbd.bodies.marker import Marker
from mbd.errors import ModelError
from mbd.forces.muscles import Muscle
from mbd.forces.muscles.paths import PointPath
from mbd.forces.muscles.wrapping import WrappingCylinder, WrappingEllipsoid, WrappingSurface
from mbd.joints.cylindrical import Cylindrical
from mbd.joints.free import Free
from mbd.joints.planar import Planar
from mbd.joints.prismatic import Prismatic
from mbd.joints.revolute import Revolute
from mbd.joints.spherical import Spherical
from mbd.joints.translation import Translation
from mbd.joints.universal import Universal
from mbd.joints.weld import Weld
from mbd.laboratory.models.report import ImportReport
from mbd.laboratory.models.written_tree import WrittenJoint, inertial_of, place_of, stops_of, tree_to_write, turned_to

KINDS = {"de groote": "DeGrooteFregly2016Muscle", "millard": "Millard2012EquilibriumMuscle"}
"""Names of muscles by their curves."""
PLAIN = {ord(mark): "_" for mark in ' ./\\:*?"<>|'}
"""What OpenSim does not allow in names becomes an underscore."""


def osim_of(model: Any) -> tuple[str, ImportReport]:
    """The text of a file, and what it tells and leaves out.

    Raises
    ------
    ModelError
        for a Screw, and joints of one's own, which the format lacks; for names that become alike.
    """
    report = ImportReport()
    values = dict(model.parameters)
    tree, report.left_out[:] = tree_to_write(model)
    ranges, stopped = _ranges(model, tree)
    names = _names(model)
    bodies, joints = list[str](), list[str]()
    muscles, rest = [], list[str]()
    surfaces: dict[str, list[str]] = {}
    for force in model.forces:
        simple = isinstance(force, Muscle) and isinstance(force.path, PointPath)
        if simple and all(isinstance(point, Frame) or _is_writable(point) for point in force.path.points):
            muscles.append(_muscle(force, names, values, surfaces))
        else:
            rest.append(f"{type(force).__name__} {force.name!r}")
    for each in tree:
        body = each.child.body
        found = inertial_of(body, values, report)
        J = found.inertia
        tensor = _text((J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]))
        bodies.append(
            f"<Body name={quoteattr(names[body.name])}><mass>{_text(found.mass)}</mass>"
            f"<mass_center>{_text(found.center)}</mass_center><inertia>{tensor}</inertia>"
            f"{_surfaces(surfaces, body.name)}</Body>"
        )
        joints.append(_joint(each, names, values, ranges.get(each.joint.name)))
    markers = [_marker(frame, names, values) for frame in model.markers if isinstance(frame, Marker)]
    report.understood.append(
        f"{len(bodies)} bodies, {len(joints)} joints, {len(markers)} markers, {len(muscles)} muscles"
    )
    changed = [f"{old!r} is {new!r}" for old, new in names.items() if old != new]
    if changed:
        more = f" and {len(changed) - 6} more" if changed[6:] else ""
        report.approximated.append(f"names without blanks: {', '.join(changed[:6])}{more}")
    report.left_out += rest
    report.left_out += [f"{type(w).__name__} {w.name!r}" for w in model.constraints if w.name not in stopped]
    report.left_out += [f"loss of joint {j.name!r}" for j in model.joints if getattr(j, "loss", None) is not None]
    report.left_out += [f"spring of joint {j.name!r}" for j in model.joints if getattr(j, "stiffness", 0.0)]
    gravity = model.gravity
    return (
        f"""<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40000">
<Model name={quoteattr(_plain(model.name))}>
<gravity>{_text(gravity if len(gravity) == 3 else (*gravity, 0.0))}</gravity>
<length_units>meters</length_units><force_units>N</force_units>
<Ground name="ground">{_surfaces(surfaces, model.ground.name)}</Ground>
<BodySet name="bodyset"><objects>
{_lines(bodies)}</objects></BodySet>
<JointSet name="jointset"><objects>
{_lines(joints)}</objects></JointSet>
<MarkerSet name="markerset"><objects>
{_lines(markers)}</objects></MarkerSet>
<ForceSet name="forceset"><objects>
{_lines(muscles)}</objects></ForceSet>
</Model>
</OpenSimDocument>
""",
        report,
    )


def _names(model: Any) -> dict[str, str]:
    """Plain names of bodies and joints."""
    found = {model.ground.name: "ground"}
    for kind in (list(model.bodies), [joint.name for joint in model.joints]):
        own = {name: _plain(name) for name in kind if name != model.ground.name}
        alike = [name for name in own if list(own.values()).count(own[name]) > 1]
        if alike:
            raise ModelError(f"{alike[0]!r} and another name are alike without blanks and dots; rename one")
        found |= own
    return found


def _joint(
    each: WrittenJoint, names: dict[str, str], values: dict[str, float], reach: tuple[float, float] | None
) -> str:
    kind, turn, coordinates, transform = _kind(each)
    parts, sockets = list[str](), list[str]()
    for side, frame in ("parent", each.parent), ("child", each.child):
        place, R = place_of(frame, values)
        body = names[frame.body.name]
        path = "/ground" if body == "ground" else f"/bodyset/{body}"
        sockets.append(f"<socket_{side}_frame>{side}_offset</socket_{side}_frame>")
        parts.append(
            f'<PhysicalOffsetFrame name="{side}_offset"><socket_parent>{path}</socket_parent>'
            f"<translation>{_text(place)}</translation><orientation>{_text(_angles(R @ turn))}</orientation>"
            "</PhysicalOffsetFrame>"
        )
    listed = "".join(_coordinate(name, reach) for name in coordinates)
    return (
        f"<{kind} name={quoteattr(names[each.joint.name])}>{''.join(sockets)}<coordinates>{listed}</coordinates>"
        f"<frames>{''.join(parts)}</frames>{transform}</{kind}>"
    )


def _kind(each: WrittenJoint) -> tuple[str, Matrix, list[str], str]:
    """Kind of the joint, a turn of both of its frames, its coordinates, and motions of a custom one."""
    joint, name = each.joint, _plain(each.joint.name)
    straight = np.eye(3)
    if isinstance(joint, Weld):
        return "WeldJoint", straight, [], ""
    if isinstance(joint, Revolute):
        return "PinJoint", turned_to(each.sign * np.array(joint.axis), 2), [name], ""
    if isinstance(joint, Prismatic):
        return "SliderJoint", turned_to(each.sign * np.array(joint.axis), 0), [name], ""
    if isinstance(joint, Universal):
        first, second = np.array(joint.axis), np.array(joint.second_axis)
        turn = np.column_stack([first, second, np.cross(first, second)])
        return "UniversalJoint", turn, [f"{name}_first", f"{name}_second"], ""
    if isinstance(joint, Planar):
        return "PlanarJoint", straight, [f"{name}_angle", f"{name}_x", f"{name}_y"], ""
    if isinstance(joint, Spherical):
        return "BallJoint", straight, [f"{name}_{axis}" for axis in ("rx", "ry", "rz")], ""
    if isinstance(joint, Free):
        return "FreeJoint", straight, [f"{name}_{axis}" for axis in ("rx", "ry", "rz", "tx", "ty", "tz")], ""
    if isinstance(joint, Translation):
        moving = {f"translation{'xyz'.index(axis) + 1}": f"{name}_{axis}" for axis in joint.axes}
        return "CustomJoint", straight, list(moving.values()), _transform(moving)
    if isinstance(joint, Cylindrical):
        moving = {"rotation3": f"{name}_angle", "translation3": f"{name}_displacement"}
        return "CustomJoint", turned_to(joint.axis, 2), list(moving.values()), _transform(moving)
    raise ModelError(f"joint '{each.joint.name}': an .osim file has no {type(joint).__name__}; take other joints")


def _transform(moving: dict[str, str]) -> str:
    """A <SpatialTransform> of coordinates along or about the axes of the frames."""
    parts = []
    for word in ("rotation", "translation"):
        for k in range(3):
            label, axis = f"{word}{k + 1}", _text(np.eye(3)[k])
            function = "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"
            own = moving.get(label, "")
            function = function if own else "<Constant><value>0</value></Constant>"
            parts.append(
                f'<TransformAxis name="{label}"><coordinates>{own}</coordinates><axis>{axis}</axis>{function}'
                "</TransformAxis>"
            )
    return f"<SpatialTransform>{''.join(parts)}</SpatialTransform>"


def _coordinate(name: str, reach: tuple[float, float] | None) -> str:
    inside = "" if reach is None else f"<range>{_text(reach)}</range><clamped>true</clamped>"
    return f"<Coordinate name={quoteattr(name)}>{inside}</Coordinate>"


def _marker(frame: Marker, names: dict[str, str], values: dict[str, float]) -> str:
    place, _ = place_of(frame, values)
    body = names[frame.body.name]
    path = "/ground" if body == "ground" else f"/bodyset/{body}"
    return (
        f"<Marker name={quoteattr(_plain(frame.name))}><socket_parent_frame>{path}</socket_parent_frame>"
        f"<location>{_text(place)}</location></Marker>"
    )


def _surfaces(known: dict[str, list[str]], body: str) -> str:
    """The surfaces of a body."""
    own = "".join(known.get(body, ()))
    return f"<WrapObjectSet><objects>{own}</objects></WrapObjectSet>" if own else ""


def _is_writable(point: Any) -> bool:
    """Whether a point of a path is a surface that the format has: sides of ellipsoids are those of their axes."""
    if isinstance(point, WrappingEllipsoid) and point.side is not None:
        return sorted(map(abs, point.side)) == [0.0, 0.0, 1.0]
    return isinstance(point, WrappingSurface)


def _surface(surface: WrappingSurface, name: str, owner: str, values: dict[str, float]) -> str:
    """A sphere, a cylinder about z whose side is x, or an ellipsoid."""
    place, R = place_of(surface.frame, values)
    sizes = [values.get(f"{owner}.{size}", value) for size, value in surface.sizes.items()]
    tag, side, more = "WrapSphere", "all", f"<radius>{_text(sizes[0])}</radius>"
    if isinstance(surface, WrappingCylinder):
        # a cylinder has no ends here, and is given 1 m
        tag, more = "WrapCylinder", f"{more}<length>{_text([*sizes, 1.0][1])}</length>"
        if surface.side is not None:
            x, y, _ = surface.side
            side, R = "x", R @ np.array([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]])
    elif isinstance(surface, WrappingEllipsoid):
        tag, more = "WrapEllipsoid", f"<dimensions>{_text(sizes)}</dimensions>"
        for axis, value in zip("xyz", surface.side or (0.0,) * 3, strict=True):
            side = {1.0: axis, -1.0: f"-{axis}"}.get(value, side)
    return (
        f"<{tag} name={quoteattr(name)}><active>true</active><xyz_body_rotation>{_text(_angles(R))}</xyz_body_rotation>"
        f"<translation>{_text(place)}</translation><quadrant>{side}</quadrant>{more}</{tag}>"
    )


def _muscle(muscle: Muscle, names: dict[str, str], values: dict[str, float], surfaces: dict[str, list[str]]) -> str:
    """A muscle, whose surfaces are added to those of their bodies."""

    def number(field: str) -> str:
        return _text(values.get(f"{muscle.name}.{field}", getattr(muscle, field)))

    points, around = list[str](), list[str]()
    for k, frame in enumerate(muscle.path.points, 1):
        if isinstance(frame, WrappingSurface):
            name = f"{_plain(muscle.name)}_surface_{k}"
            written = _surface(frame, name, f"{muscle.name} point {k}", values)
            surfaces.setdefault(frame.frame.body.name, []).append(written)
            around.append(
                f'<PathWrap name="{name}"><wrap_object>{escape(name)}</wrap_object><method>hybrid</method>'
                f"<range>{len(points)} {len(points) + 1}</range></PathWrap>"
            )
            continue
        place, _ = place_of(frame, values)
        body = names[frame.body.name]
        path = "/ground" if body == "ground" else f"/bodyset/{body}"
        points.append(
            f'<PathPoint name="p{k}"><socket_parent_frame>{path}</socket_parent_frame>'
            f"<location>{_text(place)}</location></PathPoint>"
        )
    tag = KINDS[muscle.curves]
    times = ""
    if muscle.is_delayed:
        times = (
            f"<activation_time_constant>{number('activation_time')}</activation_time_constant>"
            f"<deactivation_time_constant>{number('deactivation_time')}</deactivation_time_constant>"
        )
    if muscle.is_delayed and tag == KINDS["de groote"]:
        times += f"<activation_dynamics_smoothing>{number('smoothing')}</activation_dynamics_smoothing>"
    active = ""
    if isinstance(muscle.excitation, float):
        active = f"<default_activation>{number('excitation')}</default_activation>"
    flags = f"<ignore_tendon_compliance>{str(not muscle.is_elastic).lower()}</ignore_tendon_compliance>"
    flags += f"<ignore_activation_dynamics>{str(not muscle.is_delayed).lower()}</ignore_activation_dynamics>"
    return (
        f"<{tag} name={quoteattr(_plain(muscle.name))}>"
        f"<max_isometric_force>{number('max_force')}</max_isometric_force>"
        f"<optimal_fiber_length>{number('fiber_length')}</optimal_fiber_length>"
        f"<tendon_slack_length>{number('tendon_length')}</tendon_slack_length>"
        f"<pennation_angle_at_optimal>{number('pennation')}</pennation_angle_at_optimal>"
        f"<max_contraction_velocity>{number('max_velocity')}</max_contraction_velocity>"
        f"<fiber_damping>{number('damping')}</fiber_damping>{times}{flags}{active}"
        f"<GeometryPath><PathPointSet><objects>{''.join(points)}</objects></PathPointSet>"
        f"<PathWrapSet><objects>{''.join(around)}</objects></PathWrapSet></GeometryPath></{tag}>"
    )


def _ranges(model: Any, tree: list[WrittenJoint]) -> tuple[dict[str, tuple[float, float]], set[str]]:
    """Ranges of the joints that are written with a stop on both sides, and the names of these stops."""
    ends: dict[str, dict[float, tuple[float, str]]] = {}
    for name, measure in stops_of(model, tree):
        ends.setdefault(measure.joint.name, {})[measure.sign] = (measure.sign * measure.offset, name)
    whole = {name: own for name, own in ends.items() if len(own) == 2}
    names = {each[1] for own in whole.values() for each in own.values()}
    return {name: (own[1.0][0], own[-1.0][0]) for name, own in whole.items()}, names


def _plain(name: str) -> str:
    return name.translate(PLAIN)


def _angles(R: Matrix) -> tuple[float, float, float]:
    """x, y and z of turns about axes that move along, ``R = Rx Ry Rz``."""
    y = math.atan2(R[0, 2], math.hypot(R[0, 0], R[0, 1]))
    if math.hypot(R[0, 0], R[0, 1]) < 1e-12:
        return math.atan2(R[2, 1], R[1, 1]), y, 0.0
    return math.atan2(-R[1, 2], R[2, 2]), y, math.atan2(-R[0, 1], R[0, 0])


def _text(values: Any) -> str:
    return " ".join(repr(float(value) + 0.0) for value in np.atleast_1d(values))


def _lines(parts: Iterable[str]) -> str:
    return "".join(f"{part}\n" for part in parts)
