"""Every fault of a description at once, by name, with what to try."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, Protocol

from mbd.bodies.algebra import ZERO
from mbd.bodies.base import Body, Frame
from mbd.bodies.domains import ParameterCheck, Parameterized
from mbd.bodies.ground import Ground
from mbd.bodies.marker import Marker
from mbd.bodies.point_mass import PointMass
from mbd.constraints.base import Constraint
from mbd.constraints.controller import Controller
from mbd.constraints.machine import Machine
from mbd.errors import MbdError, ModelError, nearest
from mbd.forces.base import Force
from mbd.forces.quantities import INCREMENT_PREFIX
from mbd.forces.rotor import Rotor
from mbd.joints.base import Joint
from mbd.joints.named_angles import orientation_names
from mbd.joints.screw import Screw
from mbd.topology.description import Description
from mbd.topology.graph import disconnected
from mbd.topology.held_forces import names_of_held_forces
from mbd.topology.plan import cut_names, is_planar, plan


def faults(model: Description) -> list[str]:
    """All faults of a model, one sentence each."""
    strange = model.foreign()
    if strange:
        return strange
    if not model.joints:
        return [
            f"model '{model.name}' has no joints; connect a body to the ground, such as "
            "model.connect(mbd.Revolute('hip', model.ground.origin, thigh.start))"
        ]
    words: list[Parameterized] = [*model.bodies.values(), *model.joints, *model.forces, *model.constraints]
    found = [fault for word in words for fault in (*word.faults(), *word.value_faults(word.parameters()))]
    found += name_faults(model)
    found += reach_faults(model)
    found += mention_faults(model)
    found += rule_faults(model)
    geometry = {name for body in model.bodies.values() for name in body.parameters()}
    geometry |= {name for frame in model.points() for name in frame.parameters()}
    found += machine_faults(model, parameter_check, {*geometry, *(f"gravity.{axis}" for axis in "xyz")})
    found += choice_faults(model)
    found += massless_faults(model, model.parameters)
    found += tilted_faults(model)
    return list(dict.fromkeys(found))


def require_valid(model: Description) -> None:
    """Raise a `ModelError` with every fault, if there is one."""
    found = faults(model)
    if found:
        raise ModelError(found)


def parameter_check(model: Description) -> ParameterCheck:
    """The same judgement of other values of the parameters, without the faults that values cannot change."""
    bodies = list(model.bodies.values())
    words: list[Parameterized] = [*bodies, *model.forces]  # before joints, whose missing springs they may be named like
    words += [*model.constraints, *model.joints]
    decisive = [name for body in bodies for name in body.parameters()]
    decisive += [name for frame in model.points() for name in frame.parameters()]
    return ParameterCheck(words, model.parameters, lambda values: massless_faults(model, values), decisive)


def quantities(model: Description) -> list[str]:
    """Names that functions, measures and controllers may ask for: 't', coordinates, rates, places, velocities."""
    names = ["t"]
    for joint in (*model.joints, *_floating(model)):
        if joint.is_vector:
            names += [name for coordinate in joint.coordinate_names for name in (coordinate, f"{coordinate}.rate")]
        else:
            names += [*joint.coordinate_names, *joint.velocity_names]
        names += orientation_names(joint)
        if len(joint.freedoms) == 1:
            names.append(f"{joint.name}.rate")
    for frame in model.frames:
        names += [f"{frame}.{part}" for part in ("x", "y", "z", "vx", "vy", "vz")]
    return names


def _floating(model: Description) -> Sequence[Joint]:
    """The joints by which bodies float because of the choice of cuts; none where that choice is a fault itself."""
    try:
        return plan(model).floating
    except MbdError:
        return ()


RESULTS = (
    "acceleration", "energy", "force", "friction", "gap", "gap_rate", "multiplier", "power", "tension", "torque",
    *(f"reaction_{what}.{axis}" for what in ("force", "torque") for axis in "xyz"),
    "friction.forward", "friction.sideways", "forward.force", "sideways.force", "spin.torque",
)  # fmt: skip
"""What a run knows of joints, forces and constraints besides places and rates."""


def readable(model: Description) -> list[str]:
    """Names that controllers may read: quantities and results; which of these a word has shows when a run begins."""
    words: list[Joint | Force | Constraint] = [*model.joints, *model.forces, *model.constraints]
    owners = [word.name for word in words] + [name for joint in model.joints for name in joint.coordinate_names]
    owners += [f"{joint.name} {part}" for joint in model.joints for part in ("loss", "spring")]
    owners += [owner for joint in model.joints for _, owner, _ in joint.losses()]
    observed = [name for each in model.observations for name in (each.name, *(f"{each.name}.{axis}" for axis in "xyz"))]
    of_forces = [
        name
        for force in model.forces
        for field, result in force.results().items()
        for name in (f"{force.name}.{field}", *(f"{force.name}.{field}.{axis}" for axis in "xyz" * result.is_vector))
    ]
    held = [name for word in model.constraints for name in getattr(word, "quantity_names", ())]
    results = [f"{owner}.{result}" for owner in owners for result in RESULTS]
    whole = ["kinetic_energy", "potential_energy", "gravity.energy"]
    return [*quantities(model), *observed, *of_forces, *held, *results, *whole]


def _owners_of_states(model: Description) -> set[str]:
    """Names of what may have first-order states, 'biceps.activation'; which they have shows when a run begins."""
    names = {force.name for force in model.forces}
    names |= {word.name for word in model.constraints if word.kind in ("penalty", "nonholonomic")}
    return names | {owner for joint in model.joints for _, owner, _ in joint.losses()}


def _unknown(model: Description, name: str, known: Iterable[str]) -> str:
    """What is wrong with the name of a quantity that a law of the motion refers to."""
    if name in readable(model):
        return (
            f"{name!r} is a result of the motion, on which its laws cannot depend, but for the forces of constraints, "
            "contacts and joints, such as 'foot.force'; let a mbd.Controller read it"
        )
    return nearest(name, known, "quantity", beside=names_of_held_forces(model))


NOTEBOOK_ADVICE = "; where the cell of a notebook was run twice, let it begin with model = mbd.Model(…)"
"""The cure of words that are added to a model again."""


# names ----------------------------------------------------------------------------------------------------------
def name_faults(model: Description) -> list[str]:
    """Two things of one name."""
    bodies = _bodies_by_name(model)
    found = [
        f"{len(several)} different bodies are named '{name}'; rename them, or use one object{NOTEBOOK_ADVICE}"
        for name, several in bodies.items()
        if len(several) > 1
    ]
    kinds: dict[str, Counter[str]] = {}
    words: list[Joint | Force | Constraint] = [*model.joints, *model.forces, *model.constraints]
    for name, kind in (
        *((name, "body") for name in bodies),
        *((word.name, type(word).__name__) for word in (*words, *model.controllers)),
        *((observation.name, "observation") for observation in model.observations),
        *((f"{joint.name} loss", "loss of a joint") for joint in model.joints if joint.loss is not None),
        *((f"{joint.name} spring", "spring of a joint") for joint in model.joints if joint.stiffness != 0.0),
    ):
        kinds.setdefault(name, Counter())[kind] += 1
    for name, counts in kinds.items():
        if counts.total() > 1 and not _apart(model, name, counts):
            several_kinds = ", ".join(f"{count} × {kind}" for kind, count in counts.items())
            other = "'ground' is the body that does not move; " if name == model.ground.name else ""
            again = NOTEBOOK_ADVICE if max(counts.values()) > 1 else ""
            found.append(
                f"the name '{name}' is used {counts.total()} times ({several_kinds}); {other}give each its own name"
                f"{again}"
            )
    places: dict[str, Frame] = {}
    for frame in model.points():
        if places.setdefault(frame.full_name, frame).parameters() != frame.parameters():
            found.append(f"two different points are named '{frame.full_name}'; give each its own name")
    return found + _marker_faults(model, kinds)


def _apart(model: Description, name: str, counts: Counter[str]) -> bool:
    """Whether a body and one joint or contact share a name under which no two things of theirs have one name.

    What follows after the dot tells them apart: 'crank.mass' and 'crank.end' of the body, 'crank.angle' of the joint.
    """
    if counts["body"] != 1 or counts.total() != 2 or name == model.ground.name:
        return False
    others = [word for word in (*model.joints, *model.contacts) if word.name == name]
    if len(others) != 1:
        return False
    body, (other,) = model.bodies[name], others
    own = {*body.parameters(), *(f"{name}.{frame}" for frame in (*body.frames, *body.points))}
    own |= {frame.full_name for frame in model.points() if frame.body is body}
    known = {*other.parameters(), *(f"{name}.{result}" for result in RESULTS), f"{name}.rate"}
    if isinstance(other, Joint):
        known |= {*other.coordinate_names, *other.velocity_names, *orientation_names(other)}
    return not any(
        one == each or one.startswith(f"{each}.") or each.startswith(f"{one}.") for one in own for each in known
    )


def _bodies_by_name(model: Description) -> dict[str, list[Body]]:
    """All bodies, each once; every ground is the same."""
    bodies: dict[str, list[Body]] = {}
    for body in _all_bodies(model):
        known = bodies.setdefault(body.name, [])
        if not any(body is other or (isinstance(body, Ground) and isinstance(other, Ground)) for other in known):
            known.append(body)
    return bodies


def _marker_faults(model: Description, taken: Collection[str]) -> list[str]:
    """Markers that share a name, with each other or with another word."""
    found, bodies = [], {id(body): body for body in _all_bodies(model)}
    owners: dict[str, str] = {}
    for name, frame in ((name, frame) for body in bodies.values() for name, frame in body.points.items()):
        if isinstance(frame, Marker) and name in taken:
            found.append(f"the marker '{name}' has the name of something else; give each its own name")
        if owners.setdefault(name, frame.body.name) != frame.body.name:
            found.append(f"two markers are named '{name}', on '{owners[name]}' and '{frame.body.name}'; rename one")
    return found


def _all_bodies(model: Description) -> Iterable[Body]:
    yield model.ground
    for frame in model.points():
        yield frame.body


# what hangs together ----------------------------------------------------------------------------------------------
def reach_faults(model: Description) -> list[str]:
    """Bodies without a chain of joints to the ground."""
    lost = disconnected(model)
    found = []
    for name in lost:
        joints = [joint for joint in model.joints if name in (joint.parent.body.name, joint.child.body.name)]
        if joints:
            by = ", ".join(f"'{joint.name}'" for joint in joints)
            found.append(
                f"body '{name}' is connected by {by}, but no chain of joints leads to the ground; connect one of these "
                "bodies to model.ground.origin, with mbd.Planar or mbd.Translation if it moves freely"
            )
        else:
            users = ", ".join(f"'{word.name}'" for word in _users(model, name))
            found.append(
                f"body '{name}', which {users} refers to, is not connected by any joint; connect it, "
                "or use a frame of a body of this model"
            )
    return found


def _users(model: Description, body: str) -> list[Force | Constraint]:
    words: list[Force | Constraint] = [*model.forces, *model.constraints]
    return [w for w in words if any(isinstance(m, Frame) and m.body.name == body for m in w.mentions())]


def mention_faults(model: Description) -> list[str]:
    """Joints that were never connected, names of quantities that do not exist."""
    joints = {joint.name for joint in model.joints}
    found = [fault for each in model.observations for fault in each.faults(model.bodies, joints)]
    known = set(quantities(model))
    known |= {name for word in model.constraints for name in getattr(word, "quantity_names", ())}
    known |= set(model.parameters)
    held = names_of_held_forces(model)
    known |= {name.removesuffix(".x") for name in known if name.endswith(".x") and f"{name[:-1]}z" in known}
    owners = {force.name for force in model.forces}
    words: list[Force | Constraint] = [*model.forces, *model.constraints]
    laws = {name for word in words for name in word.laws()}
    for word in words:
        for mention in word.mentions():
            if isinstance(mention, Joint) and mention.name not in joints:
                found.append(
                    f"'{word.name}' refers to the joint '{mention.name}', which is not connected; "
                    "pass it to model.connect as well"
                )
            if isinstance(mention, str) and mention in laws:
                found.append(
                    f"'{word.name}': {mention!r} is what a law gives, so that a law that asks for it may ask for "
                    "itself; let both laws call the same function"
                )
                continue
            state = isinstance(mention, str) and mention.rpartition(".")[0] in owners  # a first-order state of a force
            if isinstance(mention, str) and mention not in known and mention not in held and not state:
                found.append(f"'{word.name}': {_unknown(model, mention, known)}")
    if any(controller.reads for controller in model.controllers):
        known = set(readable(model))
    owners = _owners_of_states(model)
    for controller in model.controllers:
        found += [
            f"'{controller.name}' reads: " + nearest(name, known, "quantity")
            for name in controller.reads
            if name not in known and name.rpartition(".")[0] not in owners
        ]
    return found


class Ruled(Protocol):
    """What has constraints that follow rules, and controllers."""

    @property
    def contacts(self) -> Sequence[Constraint]: ...

    @property
    def events(self) -> Sequence[Constraint]: ...

    @property
    def parameters(self) -> Mapping[Any, float]: ...

    @property
    def controllers(self) -> Sequence[Controller]: ...


class Machined(Protocol):
    """What has modes and sampled laws."""

    @property
    def machines(self) -> Sequence[Machine]: ...

    @property
    def parameters(self) -> Mapping[str, float]: ...


def rule_faults(model: Ruled) -> list[str]:
    """Names in When, only_while and the controllers' on= and writes= that do not exist."""
    contacts = [word.name for word in model.contacts]
    states = [name for word in getattr(model, "machines", ()) for name in word.state_titles]
    instants = [*contacts, *(event.name for event in model.events), *states]
    parameters = model.parameters
    found = []
    rolling = [word for word in getattr(model, "nonholonomic", ()) if not isinstance(word, str)]
    for word in (*model.contacts, *model.events, *rolling):
        unknown = [other for other in word.others if other not in (*contacts, *states)]
        found += [f"'{word.name}': " + nearest(other, contacts, "contact") for other in unknown]
    for controller in model.controllers:
        for name in controller.on:
            if name not in instants:
                found.append(f"'{controller.name}' on: " + nearest(name, instants, "contact or event"))
        for name in controller.writes:
            if name not in parameters:
                found.append(f"'{controller.name}' writes: " + nearest(name, parameters, "parameter", "There are"))
    return found


def machine_faults(
    model: Machined, check: Callable[[Any], ParameterCheck], geometry: Collection[str] = ()
) -> list[str]:  # fmt: skip
    """Parameters that modes and sampled laws set: that do not exist, belong to bodies, or get a value out of bounds.

    check : of the model's parameters; geometry : names of those that bodies are made of
    """
    if not model.machines:
        return []
    found, parameters = [], model.parameters
    words = {name.rpartition(".")[0] for name in parameters}
    for word in model.machines:
        for name in getattr(word, "own_outputs", ()):
            if name in words:
                near = [parameter for parameter in parameters if parameter.startswith(f"{name}.")]
                found.append(
                    f"'{word.name}': the output {name!r} is a quantity of its own, '{word.name}.{name}', and sets "
                    f"nothing of '{name}'; name a parameter, {', '.join(map(repr, near[:6]))}, or another one"
                )
        for name in (*word.parameters_by_state(), *word.held_parameters()):
            if name not in parameters:
                known = parameters.keys() - word.stands_for().keys()
                found.append(f"'{word.name}' sets {name!r}: " + nearest(name, known, "parameter", "There are"))
            elif name in geometry:
                found.append(
                    f"'{word.name}' sets {name!r}, which bodies are made of; only parameters of forces, losses, "
                    "contacts and measures change at instants"
                )
    return found or check(model).stand_in_faults()


def choice_faults(model: Description) -> list[str]:
    """Names in cut= and tunable= that do not exist."""
    parameters = model.parameters
    found = [
        "tunable: " + nearest(name, parameters, "parameter", "There are")
        for name in model.tunable
        if name not in parameters and not name.startswith(INCREMENT_PREFIX)
    ]
    try:
        cut_names(model)
    except ModelError as error:
        found += error.faults
    return found


# what nothing determines ------------------------------------------------------------------------------------------
def massless_faults(model: Description, values: Mapping[str, float]) -> list[str]:
    """Bodies whose motion nothing determines, as far as the description shows it; assembly finds the others.

    A massless body at the end of the tree may move freely; a point mass all of whose joints turn about its own point
    may spin. Bodies and joints that a constraint refers to are left to the assembly.

    Parameters
    ----------
    values : of all parameters by full name
    """
    bound = _bound(model)
    planar, found = is_planar(model), []
    held: dict[str, list[Joint]] = {}
    for joint in model.joints:
        for frame in (joint.parent, joint.child):
            held.setdefault(frame.body.name, []).append(joint)
    for body in model.bodies.values():
        joints = held.get(body.name, [])
        free = [joint for joint in joints if joint.labels and joint.name not in bound]
        if isinstance(body, Ground) or body.name in bound or not joints or len(free) < len(joints):
            continue
        one_axis = planar or len(joints) == 1
        if isinstance(body, PointMass) and one_axis and all(_spins(joint, body, values) for joint in joints):
            names = ", ".join(f"'{joint.name}'" for joint in joints)
            found.append(
                f"point mass '{body.name}' may spin about its own point, where {names} holds it, and nothing "
                "determines that motion; weld it to its neighbour (mbd.Weld), or shift it with mbd.Translation"
            )
        elif len(joints) == 1 and not any(_weights(body, values)):
            found.append(
                f"body '{body.name}' has neither mass nor inertia and '{joints[0].name}' lets it move, so nothing "
                "determines its motion; give it a mass, or weld it"
            )
    return found


def tilted_faults(model: Description) -> list[str]:
    """Bodies with an inertia about z only that a joint between them and the ground may turn out of x–y."""
    if is_planar(model):
        return []
    by_body: dict[str, list[Joint]] = {}
    for joint in model.joints:
        for frame in (joint.parent, joint.child):
            by_body.setdefault(frame.body.name, []).append(joint)
    tilted: dict[str, Joint] = {}
    reached, waiting = {model.ground.name}, [model.ground.name]
    while waiting:
        here = waiting.pop()
        for joint in by_body.get(here, []):
            ends = {joint.parent.body.name, joint.child.body.name}
            for there in ends - reached:
                reached.add(there)
                waiting.append(there)
                if here in tilted or _tilts(joint):
                    tilted[there] = tilted.get(here, joint)
    return [
        f"inertia of '{body.name}' is one number, which is about z only, and '{tilted[body.name].name}' turns it out "
        "of the plane x–y; give (Ixx, Iyy, Izz)"
        for body in model.bodies.values()
        if body.name in tilted and body.parameters().get(f"{body.name}.inertia", 0.0) != 0.0
    ]


def _tilts(joint: Joint) -> bool:
    """Whether a joint may turn its child about another axis than z, or holds it tilted."""
    if not (joint.parent.is_planar and joint.child.is_planar):
        return True
    turns = not joint.freedoms or any(label.unit == "rad" for label in joint.freedoms)
    along_z = abs(getattr(joint, "axis", ZERO)[2]) == 1.0 and not hasattr(joint, "second_axis")
    return turns and not joint.is_planar and not along_z


def _bound(model: Description) -> set[str]:
    """Joints with armature, and bodies and joints that constraints refer to, by objects or by names of quantities."""
    mentions = [mention for word in model.constraints for mention in word.mentions()]
    found = {each.body.name if isinstance(each, Frame) else each.name for each in mentions if not isinstance(each, str)}
    found |= {force.joint.name for force in model.forces if isinstance(force, Rotor)}
    named = {each for each in mentions if isinstance(each, str)}
    if named:
        found |= {joint.name for joint in model.joints if any(each.startswith(f"{joint.name}.") for each in named)}
        found |= {body for body in model.bodies if any(each.startswith(f"{body}.") for each in named)}
    return found


def _spins(joint: Joint, body: Body, values: Mapping[str, float]) -> bool:
    frame = joint.parent if joint.parent.body is body else joint.child
    turns = any(label.unit == "rad" for label in joint.freedoms) and not isinstance(joint, Screw)
    offset = [values.get(f"{frame.full_name}.{axis}", at) for axis, at in zip("xyz", frame.offset, strict=True)]
    return turns and not any(offset)


def _weights(body: Body, values: Mapping[str, float]) -> list[float]:
    """Its mass and inertias; one where something else of the same name has taken its place, as `name_faults` says."""
    fields = [field for field in body.fields() if field.startswith(("mass", "inertia"))]
    return [values.get(f"{body.name}.{field}", 1.0) for field in fields]
