"""Which joints generate coordinates and which are cut."""

from collections.abc import Sequence

from mbd.bodies.base import Body, Frame
from mbd.bodies.ground import Ground
from mbd.bodies.level import Level
from mbd.bodies.point_mass import PointMass
from mbd.dataclass import dataclass
from mbd.errors import ModelError, nearest
from mbd.joints.base import Joint
from mbd.joints.free import Free
from mbd.joints.planar import Planar
from mbd.joints.reversed import Reversed
from mbd.joints.translation import Translation
from mbd.topology.description import Description
from mbd.topology.graph import links_of, mobility, spanning_tree
from mbd.topology.held_forces import reactions_read


@dataclass(frozen=True)
class Plan:
    """How coordinates are chosen; the choice never changes the physics.

    Attributes
    ----------
    edges : joints of the tree, each after the one that leads to its parent body; the child is always the new body
        (a joint that the user described the other way round stands here as `Reversed`)
    cut : joints that become rows, as the user described them
    floating : those of `edges` that were added because cutting left a body without a path, named '<body> floating'
    planar : whether all moves in x–y and turns about z
    mobility : Grübler's count
    notes : what a user should know about the choice
    """

    edges: tuple[Joint, ...]
    cut: tuple[Joint, ...]
    floating: tuple[Joint, ...]
    planar: bool
    mobility: int
    notes: tuple[str, ...] = ()

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The moving bodies, in the order of `edges`."""
        return tuple(joint.child.body for joint in self.edges)

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """The generalized coordinates, in order."""
        return tuple(name for joint in self.edges for name in joint.coordinate_names)

    @property
    def dof(self) -> int:
        """Degrees of freedom of the tree: its velocities, fewer than its coordinates where these are quaternions."""
        return sum(len(joint.freedoms) for joint in self.edges)

    def path(self, body: Body | str) -> tuple[Joint, ...]:
        """The joints of the tree from the ground to a body."""
        name = body if isinstance(body, str) else body.name
        leads = {joint.child.body.name: joint for joint in self.edges}
        found: list[Joint] = []
        while name in leads:
            found.append(leads[name])
            name = leads[name].parent.body.name
        return tuple(reversed(found))


def plan(model: Description) -> Plan:
    """The tree, the cut joints and the floating bodies of a model whose `cut` is 'auto', 'loops', 'all' or names."""
    loaded = {joint.name for joint in model.joints if needs_reaction(joint)}
    return _plan(model, cut_names(model) | loaded | reactions_read(model))


def uncut(model: Description, with_reactions: bool = False) -> Plan:
    """The same as `plan`, of the model that has nothing but its loops cut, and joints whose reactions laws read."""
    return _plan(model, reactions_read(model) if with_reactions else set())


def _plan(model: Description, wanted: set[str]) -> Plan:
    """The tree without some joints."""
    planar = is_planar(model)
    links = links_of(model, without=wanted)
    tree, closing, reached = spanning_tree(links, model.ground.name)
    edges = _oriented(tree, [model.ground.name])
    levels = _levels(model) if planar and wanted else {}
    floating: list[Joint] = []
    for body in model.bodies.values():
        if body.name in reached:
            continue
        floats = floating_joint(model, body, planar, levels.get(body.name, model.ground.origin))
        more, closes, found = spanning_tree(links, body.name)
        floating.append(floats)
        edges += [floats, *_oriented(more, [body.name])]
        closing += closes
        reached += found
    names = {joint.name for joint in closing} | wanted
    notes = [f"'{joint.parent.body.name}' … '{joint.child.body.name}': loop cut at '{joint.name}'" for joint in closing]
    notes += [f"'{joint.child.body.name}' floats" for joint in floating]
    return Plan(
        tuple(edges),
        tuple(joint for joint in model.joints if joint.name in names),
        tuple(floating),
        planar,
        mobility(len(model.bodies) - 1, model.joints, planar),
        tuple(notes),
    )


def cut_names(model: Description) -> set[str]:
    """Names of the joints that the user wants cut, besides those that close a loop."""
    names = [joint.name for joint in model.joints]
    if isinstance(model.cut, str):
        if model.cut == "all":
            return set(names)
        if model.cut in ("auto", "loops"):
            return set()
        raise ModelError(f"cut is 'auto', 'loops', 'all' or a list of names of joints, got {model.cut!r}")
    for name in model.cut:
        if name not in names:
            raise ModelError("cut: " + nearest(name, names, "joint"))
    return set(model.cut)


def needs_reaction(joint: Joint) -> bool:
    """Whether its friction follows the force that it transmits, which rows must carry."""
    return any(loss.needs_reaction for _, _, loss in joint.losses())


def is_planar(model: Description) -> bool:
    """Whether every joint turns about z only and shifts in x–y only."""
    return all(joint.is_planar and joint.parent.is_planar and joint.child.is_planar for joint in model.joints)


def _levels(model: Description) -> dict[str, Level]:
    """The origin of the ground at the heights at which joints hold the bodies of a planar model, by body."""
    ground = model.ground
    tree, _, _ = spanning_tree(links_of(model), ground.name)
    found = {ground.name: Level(ground, "origin")}
    for joint in _oriented(tree, [ground.name]):
        near, far = joint.parent, joint.child
        x, y, z = found[near.body.name].offset
        raised = (x, y, z + near.offset[2] - far.offset[2])
        found[far.body.name] = Level(ground, "level", raised, steps=(*found[near.body.name].steps, (near, far)))
    return found


def floating_joint(model: Description, body: Body, planar: bool, origin: Frame) -> Joint:
    """The joint by which a body floats against a frame of the ground, without constraining it."""
    name = f"{body.name} floating"
    if isinstance(body, PointMass) and not _is_turned(model, body):
        return Translation(name, origin, body.origin, axes="xy" if planar else "xyz")
    if planar:
        return Planar(name, origin, body.origin)
    return Free(name, origin, body.origin)


def _is_turned(model: Description, body: Body) -> bool:
    """Whether a joint without an angle holds the body's axes to those of a moving body or of a turned frame.

    Also where a joint holds it beside its own point, and where it has to give a torque, which its rows must carry,
    since something else acts beside the body's origin.
    """
    for joint in model.joints:
        for own, other in (joint.parent, joint.child), (joint.child, joint.parent):
            if own.body is body and any(own.offset) and len(joint.freedoms) > 0:
                return True  # an arm of the mass turns with it
            holds = own.body is body and all(label.unit != "rad" for label in joint.freedoms)
            if holds and not (_is_level(own) and _is_level(other) and isinstance(other.body, Ground)):
                return True
            if holds and _has_moments(model, body, joint):
                return True
    return False


def _has_moments(model: Description, body: Body, holding: Joint) -> bool:
    """Whether more than the joint that holds it can turn a point mass: joints, surfaces that it carries, arms."""
    for joint in model.joints:
        if joint is not holding and body in (joint.parent.body, joint.child.body) and _gives_torque(model, joint):
            return True
    carriers = [getattr(getattr(word, "measure", None), "carrier", None) for word in model.constraints]
    mentioned = [mention for mention in model.mentions() if isinstance(mention, Frame) and mention.landmark is None]
    frames = [frame for frame in (*carriers, *mentioned) if frame is not None]
    return any(frame.body is body for frame in frames)


def _gives_torque(model: Description, joint: Joint) -> bool:
    """Whether anything acts along a joint's coordinates: its loss or spring, or a word that mentions it."""
    names = [mention for mention in model.mentions() if isinstance(mention, str)]
    mentioned = joint in model.mentions() or any(name.startswith(f"{joint.name}.") for name in names)
    tunable = any(name.startswith(f"{joint.name} ") for name in model.tunable)
    return mentioned or tunable or joint.loss is not None or joint.stiffness != 0.0


def _is_level(frame: Frame) -> bool:
    return frame.rotation is None


def _oriented(tree: Sequence[Joint], roots: Sequence[str]) -> list[Joint]:
    """The joints of a tree so that each leads from a known body to a new one."""
    known, result = set(roots), list[Joint]()
    for joint in tree:
        forward = joint.parent.body.name in known
        result.append(joint if forward else Reversed(joint))
        known |= {joint.parent.body.name, joint.child.body.name}
    return result
