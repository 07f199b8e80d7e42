"""Models of MuJoCo, ``.xml``, through its own compiler, which resolves includes, defaults and inertia from shapes."""

import math
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mbd.arrays import Matrix
from mbd.bodies.base import Body, Frame
from mbd.bodies.marker import Marker
from mbd.bodies.rigid_body import RigidBody
from mbd.constraints.base import Constraint
from mbd.constraints.bilateral import Bilateral
from mbd.constraints.measures import extension, flexion
from mbd.constraints.unilateral import Unilateral
from mbd.constraints.user_measure import measure
from mbd.errors import ModelError, quoted
from mbd.forces.rotor import Rotor
from mbd.joints.base import Joint
from mbd.joints.free import Free
from mbd.joints.losses import Coulomb, Viscous
from mbd.joints.prismatic import Prismatic
from mbd.joints.revolute import Revolute
from mbd.joints.spherical import Spherical
from mbd.joints.weld import Weld
from mbd.laboratory.models.osim_elements import plain, unlike
from mbd.laboratory.models.report import ImportedModel, ImportReport
from mbd.model import Model
from mbd.results.tables import library

FREE, BALL, SLIDE, HINGE = 0, 1, 2, 3
"""Kinds of joints, as ``mjtJoint`` counts them."""
EQUAL_JOINTS = 2
"""Equations between joints, as ``mjtEq`` counts them."""


def read_mjcf(path: Path, stops: bool, losses: bool) -> ImportedModel:
    """A model with z of the file turned to y; several joints of a body have bodies without mass between them.

    See `mbd.read_model`.
    """
    mujoco = library("mujoco", "mjcf", "reading MJCF")
    try:
        source = mujoco.MjModel.from_xml_path(str(path))
    except Exception as error:  # of any kind, such as ValueError with the compiler's words
        words = " ".join(str(error).split())[:300]
        raise ModelError(f"{path.name} is no model that MuJoCo compiles: {words}") from None
    try:
        return _Reader(mujoco, source, path, stops, losses).read()
    except UnicodeDecodeError as error:
        raise ModelError(f"{path.name}: a name in it is no text in UTF-8: {error}") from None


class _Reader:
    """The steps of reading one file."""

    def __init__(self, mujoco: Any, source: Any, path: Path, stops: bool, losses: bool) -> None:
        self.mujoco, self.source, self.stops, self.losses = mujoco, source, stops, losses
        self.report, self.names = ImportReport(), set[tuple[Any, str]]()
        title = " ".join(path.stem.replace(".", "_").split())
        x, y, z = map(float, source.opt.gravity)
        self.model = Model(title or "model", gravity=(x, z, -y))
        self.bodies, self.joints, self.held = dict[str, Body](), dict[str, Joint](), list[Constraint]()
        self.of_joint: dict[int, Joint] = {}
        self.rotors = list[str]()
        self.sites = 0

    def read(self) -> ImportedModel:
        """Bodies and joints from the world outwards, then couplings and the report."""
        source = self.source
        made: list[Body | None] = [None]
        for number in range(1, source.nbody):
            made.append(self._body(number, made))
        self.model.connect(*self.joints.values())
        self.sites = self._sites(made)
        self.held += self._couplings()
        self.model.constrain(*self.held)
        self._summary()
        return ImportedModel(self.model, self.bodies, self.joints, self.report)

    def _name(self, kind: Any, number: int, otherwise: str) -> str:
        """The name of an object, plain and its own."""
        given = self.mujoco.mj_id2name(self.source, kind, number) or otherwise
        name = " ".join(given.replace(".", "_").split()) or otherwise
        name = f"{name} body" if name == "ground" else name
        while (kind, name) in self.names:
            name += " again"
        self.names.add((kind, name))
        return name

    def _body(self, number: int, made: list[Body | None]) -> Body:
        """A body with its joints to the parent."""
        source = self.source
        name = self._name(self.mujoco.mjtObj.mjOBJ_BODY, number, f"body {number}")
        R = _rotation(source.body_iquat[number])
        tensor = R @ np.diag(source.body_inertia[number]) @ R.T
        mass = float(source.body_mass[number])
        elements = [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]]
        inertia = tuple(map(float, elements)) if mass > 0.0 else (0.0,) * 6
        body: Body = RigidBody(name, mass, inertia, tuple(map(float, source.body_ipos[number])))
        self.bodies[name] = body
        place, turn = source.body_pos[number], source.body_quat[number]
        parent = made[int(source.body_parentid[number])]
        first, count = int(source.body_jntadr[number]), int(source.body_jntnum[number])
        if not count:
            self._add(Weld(f"{name} mount", self._at(parent, place, turn), body.origin))
            return body
        between = body
        for k in range(first, first + count):
            end = body if k == first + count - 1 else RigidBody(f"{name} {k - first + 1}", 0.0, (0.0,) * 6)
            anchor = np.asarray(source.jnt_pos[k])
            if k == first:
                frame = self._at(parent, place + _rotation(turn) @ anchor, turn)
            else:
                frame = _point(between, anchor)
            between = end
            self._joint(k, name, frame, end, anchor)
        return body

    def _at(self, parent: Body | None, place: Any, turn: Any) -> Frame:
        """A frame on the parent; on the ground, whose y is z of the file, for the world."""
        if parent is None:
            x, y, z = map(float, place)
            frame = self.model.ground.point(x, z, -y).turned(-0.5 * math.pi, (1.0, 0.0, 0.0))
        else:
            frame = _point(parent, place)
        w, *axis = map(float, turn)
        size = math.hypot(*axis)
        return frame.turned(2.0 * math.atan2(size, w), tuple(axis)) if size > 0.0 else frame

    def _joint(self, k: int, body: str, frame: Frame, end: Body, anchor: Any) -> None:
        source = self.source
        name = self._name(self.mujoco.mjtObj.mjOBJ_JOINT, k, f"{body} joint {k}")
        kind, dof = int(source.jnt_type[k]), int(source.jnt_dofadr[k])
        child = _point(end, anchor)
        if kind == FREE:
            ground = self.model.ground.origin.turned(-0.5 * math.pi, (1.0, 0.0, 0.0))
            joint: Joint = Free(name, ground, end.origin)
        elif kind == BALL:
            joint = Spherical(name, frame, child, **self._resistance(k, dof, False))
        else:
            made = Revolute if kind == HINGE else Prismatic
            x, y, z = map(float, source.jnt_axis[k])
            joint = made(name, frame, child, axis=(x, y, z), **self._resistance(k, dof, True))
            if self.stops and source.jnt_limited[k]:
                low, high = (float(limit) - self._reference(k) for limit in source.jnt_range[k])
                self.held += [
                    Unilateral(f"{name} lower stop", extension(joint, offset=low)),
                    Unilateral(f"{name} upper stop", flexion(joint, offset=-high)),
                ]
        self.of_joint[k] = joint
        self._add(joint)
        armature = float(source.dof_armature[dof])
        if armature > 0.0 and kind >= SLIDE:
            rotor = f"{name} rotor"
            self.model.apply(Rotor(rotor, joint, armature))
            self.rotors.append(joint.name)

    def _add(self, joint: Joint) -> None:
        self.joints[joint.name] = joint

    def _reference(self, k: int) -> float:
        """The value of a hinge or slide in the posture of the file, where the coordinate of mbd is zero."""
        return float(self.source.qpos0[int(self.source.jnt_qposadr[k])])

    def _resistance(self, k: int, dof: int, scalar: bool) -> dict[str, Any]:
        """Loss and spring of a joint."""
        if not self.losses:
            return {}
        source, parts = self.source, list[Any]()
        if source.dof_damping[dof] > 0.0:
            parts.append(Viscous(float(source.dof_damping[dof])))
        if source.dof_frictionloss[dof] > 0.0 and scalar:
            parts.append(Coulomb(float(source.dof_frictionloss[dof])))
        found: dict[str, Any] = {}
        if parts:
            found["loss"] = parts[0] if len(parts) == 1 else parts[0] + parts[1]
        if np.max(source.jnt_stiffness[k]) > 0.0:
            found["stiffness"] = float(np.ravel(source.jnt_stiffness[k])[0])
            if scalar:
                found["rest"] = float(source.qpos_spring[int(source.jnt_qposadr[k])]) - self._reference(k)
        return found

    def _sites(self, made: list[Body | None]) -> int:
        """Sites with names as points of their bodies, where markers stick; how many there are."""
        taken, count = {*self.bodies, *self.joints, "ground"}, 0
        for k in range(self.source.nsite):
            given = self.mujoco.mj_id2name(self.source, self.mujoco.mjtObj.mjOBJ_SITE, k)
            name, body = plain(given or ""), made[int(self.source.site_bodyid[k])]
            if not name or body is None:
                continue
            called = unlike(name, taken, " site")
            x, y, z = map(float, self.source.site_pos[k])
            Marker(called, body, (x, y, z))
            count += 1
        return count

    def _couplings(self) -> list[Constraint]:
        """Equations between two hinges or slides as rows."""
        source, found = self.source, list[Constraint]()
        for number in range(source.neq):
            if int(source.eq_type[number]) != EQUAL_JOINTS:
                continue
            own, other = int(source.eq_obj1id[number]), int(source.eq_obj2id[number])
            factors = tuple(map(float, source.eq_data[number][:5]))
            first = self.of_joint[own]
            names = [first.coordinate_names[0]]
            names += [self.of_joint[other].coordinate_names[0]] if other >= 0 else []
            unit = first.labels[0].unit
            name = self._name(self.mujoco.mjtObj.mjOBJ_EQUALITY, number, f"{first.name} coupling")
            found.append(Bilateral(name, measure(partial(_apart, factors=factors), *names, unit=unit)))
        if found:
            self.report.approximated.append(f"{len(found)} soft equations between joints are rigid couplings")
        return found

    def _summary(self) -> None:
        source, report = self.source, self.report
        kinds = [int(kind) for kind in source.jnt_type]
        words = {FREE: "free", BALL: "ball", SLIDE: "slide", HINGE: "hinge"}
        counts = ", ".join(f"{kinds.count(kind)} {word}" for kind, word in words.items() if kind in kinds)
        title = f"{source.nbody - 1} bodies and {source.njnt} joints ({counts or 'none'}), z of the file is y"
        report.understood.append(title)
        if self.sites:
            report.understood.append(f"{self.sites} sites as markers")
        limited = int(np.sum(np.asarray(source.jnt_limited) != 0))
        if limited:
            text = f"soft limits of {limited} joints"
            if self.stops:
                report.approximated.append(f"{text} are rigid stops")
            else:
                report.left_out.append(text)
        turned = [joint.name for k, joint in self.of_joint.items() if kinds[k] >= SLIDE and self._reference(k)]
        if turned:
            report.approximated.append(f"coordinates are counted from the posture of the file: {quoted(turned)}")
        if self.rotors:
            names = quoted(self.rotors)
            report.understood.append(f"armature (inertia of rotors) of {len(self.rotors)} joints: {names}")
        dofs = {k: int(source.jnt_dofadr[k]) for k in self.of_joint}
        heavy = [j.name for k, j in self.of_joint.items() if kinds[k] < SLIDE and source.dof_armature[dofs[k]] > 0.0]
        if heavy:
            report.left_out.append(f"armature of joints of several coordinates: {quoted(heavy)}")
        others = sum(int(kind) != EQUAL_JOINTS for kind in source.eq_type)
        rest = {
            "shapes (contacts)": source.ngeom, "actuators": source.nu, "tendons": source.ntendon,
            "sensors": source.nsensor, "sites of the world or without a name": source.nsite - self.sites,
            "equations of other kinds": others,
        }  # fmt: skip
        report.left_out += [f"{count} {word}" for word, count in rest.items() if count]
        if not self.losses and (np.any(source.dof_damping > 0.0) or np.any(source.jnt_stiffness > 0.0)):
            report.left_out.append("damping, friction and springs of joints")


def _point(body: Body, place: Any) -> Frame:
    x, y, z = map(float, place)
    return body.point(x, y, z) if x or y or z else body.origin


def _rotation(q: Any) -> Matrix:
    """Of a unit quaternion (w, x, y, z)."""
    w, x = float(q[0]), np.asarray(q[1:], dtype=float)
    skew = np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])
    return np.asarray(np.eye(3) + 2.0 * w * skew + 2.0 * skew @ skew)


def _apart(own: Any, other: Any = 0.0, factors: tuple[float, ...] = ()) -> Any:
    """q − Σ c_k q'^k."""
    value: Any = 0.0
    for factor in reversed(factors):
        value = value * other + factor
    return own - value
