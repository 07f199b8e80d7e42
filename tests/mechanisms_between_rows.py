"""Random mechanisms to ask for results between rows: trees, loops, redundant rows, closed contacts, free turns."""

import random
from collections.abc import Callable

import mbd
from mbd.errors import AssemblyError
from mbd.hardcases.redundant_rows import bricard, parallel_cranks
from mbd.testing.mechanisms import random_loop, random_tree
from tests.equations.mechanisms import furnished
from tests.fuzz.spatial_structures import turned_four_bar
from tests.space_scenes import JOINTS, scene


def tree(seed: int) -> tuple[mbd.Model, mbd.State]:
    """A planar or spatial tree with springs, losses, forces and a rod of prescribed length."""
    model = furnished(random_tree(seed, 3, spatial=seed % 2 == 0), seed).without("foot", "pad")
    try:
        return model, mbd.assemble(model, project=True)
    except AssemblyError:  # a rod too far away to be reached
        model = model.without("rod")
        return model, mbd.assemble(model)


def loop(seed: int) -> tuple[mbd.Model, mbd.State]:
    """A planar loop of bars, some hinges with losses, driven through a spring; sometimes with every joint cut."""
    model, angles = random_loop(seed)
    rng = random.Random(seed)
    rest = angles["hinge 0.angle"] + 0.5
    model.apply(mbd.TorsionSpring("spring", model.joints[0], stiffness=rng.uniform(1.0, 20.0), rest=rest))
    return model, mbd.assemble(model, position=angles, velocity={"hinge 0.angle": rng.uniform(-2.0, 2.0)}, project=True)


def redundant(seed: int) -> tuple[mbd.Model, mbd.State]:
    """Parallel cranks with one or two too many, or Bricard's mechanism, in tree coordinates or with all joints cut.

    Every third one a four-bar that lies somewhere in space, all of its joints cut.
    """
    rng = random.Random(seed)
    if seed % 3 == 2:
        model, angles = turned_four_bar(rng)
        model.cut = "all"
        return model, mbd.assemble(model, position=angles, velocity={"joint 0.angle": 2.0}, project=True)
    cut = rng.choice(["auto", "all"])
    if seed % 3 == 0:
        return bricard()
    return parallel_cranks(cut=cut, count=rng.choice([3, 4]))


def standing(seed: int) -> tuple[mbd.Model, mbd.State]:
    """A plate on sticking, sliding or smooth feet that stay closed, with a pendulum on it and a spring to a wall."""
    rng = random.Random(seed)
    model = mbd.Model(f"standing {seed}")
    plate = mbd.RigidBody("plate", mass=3.0, inertia=0.4)
    model.connect(mbd.Planar("place", model.ground.origin, plate.origin))
    feet = rng.choice([[-0.8, 0.8], [-0.8, 0.1, 0.8]])
    friction = rng.choice([0.0, 0.1, None])
    for k, x in enumerate(feet):
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(plate.point(x, -0.2)), friction=friction))
    rod = mbd.Link("rod", 0.8, 0.5, 0.25, 0.02)
    loss = rng.choice([None, mbd.Viscous(0.1), mbd.Coulomb(0.05)])
    model.connect(mbd.Revolute("hinge", plate.point(0.0, 0.1), rod.start, loss=loss))
    model.apply(mbd.Spring("spring", model.ground.point(3.0, 0.0), plate.origin, stiffness=10.0, length=2.5))
    start = mbd.assemble(
        model, closed=[f"foot {k}" for k in range(len(feet))], position={"place.y": 0.2, "hinge.angle": 0.4},
        velocity={"hinge.angle": rng.uniform(1.0, 2.0), "place.x": 0.0 if friction is None else 2.0},
    )  # fmt: skip
    return model, start


def turning(seed: int) -> tuple[mbd.Model, mbd.State]:
    """Bodies that turn freely in space, with every joint in turn, in a tree or, where the seed is odd, in a loop."""
    kind, joints = ("loop" if seed % 2 else "tree"), [joint for joint in JOINTS if joint != "free"]
    made = scene(kind, joints[seed // 2 % len(joints)], seed)
    return made.model, made.start


KINDS: dict[str, Callable[[int], tuple[mbd.Model, mbd.State]]] = {
    "tree": tree, "loop": loop, "redundant": redundant, "standing": standing, "turning": turning,
}  # fmt: skip
