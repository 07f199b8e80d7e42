"""Laws that hold at every instant: places, closure of loops, balance of forces, constraints, contacts, energies."""

from typing import Any

import numpy as np

import mbd
from mbd.joints.base import Joint
from tests.fuzz.bodies import Bodies, mass_of
from tests.fuzz.faults import Faults
from tests.fuzz.geometry import Array, Moving, cross, inverse, product, twist
from tests.fuzz.loads import Loads
from tests.fuzz.quantities import gap_of, named, value_of
from tests.fuzz.round_bodies import edge_gap

HELD = 1e-7
"""What rows may miss, over the size of the mechanism [-]."""
ROUND_OFF = 1e-15
"""That of the entries of a rotation matrix, from which orientations are read [-]."""
KINK = 1e4
"""Of `Gap.blur`: g has a kink from there on [-]."""
BEGINNING = 1e-6
"""Speed [m/s] beside which friction keeps some of the direction in which sliding began."""
EQUAL = 1e-9
"""What two ways to compute one number may differ by, over what it is made of [-]."""


def size_of(bodies: Bodies) -> float:
    """Extent of the mechanism: the largest distance of a frame from the origin [m], at least 1."""
    reach = [float(np.max(np.abs(placed.H[:, :3, 3]), initial=0.0)) for placed in bodies.placed.values()]
    arms = [float(np.max(np.abs(bodies.constant(frame)[:3, 3]))) for frame in bodies.model.frames.values()]
    return 1.0 + max(reach, default=0.0) + max(arms, default=0.0)


def places(found: Faults, bodies: Bodies) -> None:
    """Reported places and velocities of frames are those of forward kinematics."""
    told, size = bodies.told, size_of(bodies)
    for name, frame in bodies.model.frames.items():
        if f"{name}.x" not in told:
            continue
        off = np.max(np.abs(told.vector(name) - bodies.place(frame)), axis=1)
        found.small("place of a frame", name, off, EQUAL * size)
        if f"{name}.vx" in told:
            own = bodies.velocity(frame.body.name, bodies.place(frame))
            reported = np.stack([told[f"{name}.v{axis}"] for axis in "xyz"], axis=1)
            fast = size * (
                1.0 + np.linalg.norm(own, axis=1) + np.linalg.norm(bodies.twist(frame.body.name).angular, axis=1)
            )
            found.small("velocity of a frame", name, np.max(np.abs(reported - own), axis=1), EQUAL * fast)


def closure(found: Faults, bodies: Bodies, rates: bool = True, told: int = 0) -> None:
    """Joints that close loops fit: their frames, seen over both branches, differ by the joint's own motion alone.

    Parameters
    ----------
    rates : whether velocities are held too
    told : how many instants are next to singular poses, where the run says that they are not
    """
    size = size_of(bodies)
    for joint in bodies.closing:
        across, gap = _apart(bodies, joint)
        off = np.max(np.abs(gap.H - np.eye(4)), axis=(1, 2))
        found.small("joint holds its frames together", joint.name, off, HELD * size)
        if not rates:
            continue
        motion = np.abs(across.first).max(axis=(1, 2))
        found.small("velocities fit at a joint", joint.name, _parting(gap), HELD * size * (1.0 + motion), told=told)


def _apart(bodies: Bodies, joint: Joint) -> tuple[Moving, Moving]:
    """The child's frame seen from the parent's over the other branch, and what of that is not the joint's motion."""
    across = product(inverse(bodies.frame(joint.parent)), bodies.frame(joint.child))
    return across, product(inverse(bodies.between(joint)), across)


def _parting(gap: Moving) -> Array:
    apart = twist(gap)
    return np.asarray(np.linalg.norm(apart.angular, axis=1) + np.linalg.norm(apart.linear, axis=1))


def balance(found: Faults, bodies: Bodies, acting: Loads, share: Any, more: Any = 0.0) -> None:
    """Newton's and Euler's equations of every body: ``m a_c = Σ F``, ``I ω̇ + ω × I ω = Σ T`` about the mass center.

    Parameters
    ----------
    share : what is allowed of the sum of the terms, a number or (n,) [-]
    more : what forces may miss besides, (n,) [N]
    """
    planar = all(j.is_planar and j.parent.is_planar and j.child.is_planar for j in bodies.model.joints)
    sizes = [load.force_size for load in acting.on.values()]
    whole = np.max(sizes, axis=0) if sizes else 0.0
    reach = size_of(bodies)
    motions = [bodies.twist(name) for name in acting.on]
    spinning = np.max([np.sum(m.angular**2, axis=1) for m in motions], axis=0, initial=0.0)
    whirl = reach * (
        spinning + np.max([np.linalg.norm(m.angular_second, axis=1) for m in motions], axis=0, initial=0.0)
    )
    terms, largest = {}, np.zeros(len(bodies.told))
    for name, load in acting.on.items():
        mass = mass_of(bodies.model.bodies[name], bodies.told.parameters)
        R, motion = bodies.placed[name].H[:, :3, :3], bodies.twist(name)
        arm = R @ mass.center
        a = motion.linear_second + cross(motion.angular_second, arm) + cross(motion.angular, cross(motion.angular, arm))
        inertia = R @ mass.inertia @ np.swapaxes(R, 1, 2)
        spin, change = motion.angular[:, :, None], motion.angular_second[:, :, None]
        gyro = cross(motion.angular, (inertia @ spin)[:, :, 0])
        turn = (inertia @ change)[:, :, 0]
        force, torque = mass.mass * a - load.force, turn + gyro - load.torque
        if planar:
            force, torque = force[:, :2], torque[:, 2:]
        heavy = mass.mass * (np.linalg.norm(a, axis=1) + whirl) + load.force_size
        twisted = np.linalg.norm(turn, axis=1) + np.linalg.norm(gyro, axis=1) + load.torque_size
        twisted = twisted + mass.mass * reach * whirl
        terms[name] = force, heavy, torque, None if mass.planar and not planar else twisted
        largest = np.maximum(largest, np.maximum(heavy, twisted))
    # what Newton's method leaves, at the two joints of a body, of the largest terms that there have been: those of
    # forces and of moments about joints, inertia among them
    most = 2e-3 * share * np.maximum.accumulate(largest)
    small = 1e-9 * np.max(whole, initial=0.0)
    for name, (force, heavy, torque, twisted) in terms.items():
        limit = share * heavy + most + 1e-9 + small + more
        found.small("balance of forces", name, np.linalg.norm(force, axis=1), limit)
        if twisted is not None:
            limit = share * twisted + 1e-9 + reach * (most + small + more)
            found.small("balance of torques", name, np.linalg.norm(torque, axis=1), limit)


def kinks(bodies: Bodies) -> Array:
    """Where a contact that is closed has a kink, so that its force has no direction of its own (n,)."""
    found = np.zeros(len(bodies.told), dtype=bool)
    for word in bodies.model.contacts:
        if isinstance(word, mbd.Unilateral | mbd.Penalty):
            gap = gap_of(word.measure, bodies)
            found |= bodies.told.closed[word.name].astype(bool) & (gap.blur >= KINK)
    return found


def constraints(found: Faults, bodies: Bodies) -> None:
    """What always acts holds: measures at their values, rows on velocities."""
    size = size_of(bodies)
    for word in bodies.model.constraints:
        if isinstance(word, mbd.Bilateral):
            wanted = value_of(word.value, word.arguments, bodies, word.name, "value")
            off = gap_of(word.measure, bodies).value - wanted
            found.small("constraint holds", word.name, off, HELD * (size + np.max(np.abs(wanted), initial=0.0)))
        elif isinstance(word, mbd.KnifeEdge):
            R = bodies.frame(word.frame).H[:, :3, :3]
            v = bodies.velocity(word.frame.body.name, bodies.place(word.frame))
            off = np.sum(v * (R @ np.asarray(word.normal)), axis=1)
            found.small("row on velocities holds", word.name, off, HELD * (size + np.linalg.norm(v, axis=1)))
        elif isinstance(word, mbd.Nonholonomic):
            assert callable(word.row)
            values = [named(given, bodies) for _, given in word.arguments]
            bias = value_of(word.bias, (("t", "t"),), bodies, word.name, "bias")
            scale = sum(np.abs(value) for value in values)
            found.small("row on velocities holds", word.name, word.row(*values) + bias, HELD * (size + scale))
        elif isinstance(word, mbd.Rolling) and word.axis is not None:
            radius = bodies.told.parameters[f"{word.name}.radius"]
            gap = edge_gap(word.center, radius, word.axis, word.ground, bodies)
            slip = gap.slip(bodies)
            off = np.linalg.norm([np.sum(slip * direction, axis=1) for _, direction in gap.tangents], axis=0)
            found.small("row on velocities holds", word.name, off, HELD * size * 100.0)
        elif isinstance(word, mbd.Rolling):
            found.small("row on velocities holds", word.name, _slip(word, bodies), HELD * size * 100.0)


def drives(found: Faults, bodies: Bodies, run: Any) -> None:
    """A driven coordinate has the acceleration of what drives it, within what the scheme errs in its steps.

    With `tol` that is round-off, as steps of explicit schemes and Radau's are. In fixed steps of the Newmark family it
    is a few times the largest difference of that acceleration over a step.
    """
    told = bodies.told
    exact = bool(run.settings.get("tol")) or run.settings["integrator"].startswith(("Runge", "Radau"))
    h = float(np.max(np.diff(run.time), initial=0.0))
    grid = np.linspace(float(run.time[0]), float(run.time[-1]), 400)
    for word in bodies.model.bilaterals:
        if not isinstance(word, mbd.Bilateral) or not isinstance(word.subject, Joint) or not callable(word.value):
            continue
        if isinstance(word.value, mbd.Samples) or word.subject.coordinate_names[0] not in told.tree:
            continue
        change, sure = _second(word.value, told.time)
        bend = _second(word.value, grid)[0]
        limit = 1e-4 * np.max(np.abs(bend)) + 1e-4 + 2e-4 * np.max(np.abs(np.diff(bend))) / (grid[1] - grid[0])
        if not exact:
            around = np.stack([_second(word.value, grid + shift)[0] for shift in (-h, 0.0, h)])
            limit = limit + 2.0 * np.max(np.ptp(around, axis=0))
        off = told[f"{word.subject.coordinate_names[0]}.acceleration"] - change
        found.small("a drive gives its acceleration", word.name, off, limit, sure)


def _second(function: Any, t: Array) -> tuple[Array, Array]:
    """d²f/dt² by central differences, and where those on both sides agree, so that nothing jumps there."""
    d = 1e-4
    before, there, after = (
        (function(s + d) - 2.0 * function(s) + function(s - d)) / d**2 + 0.0 * t for s in (t - 2.0 * d, t, t + 2.0 * d)
    )
    size, scale = np.max(np.abs(there), initial=0.0), np.max(np.abs(function(t)), initial=1.0)
    return np.asarray(there), np.abs(after - before) <= 0.02 * size + 1e-6 * scale


def _slip(word: mbd.Rolling, bodies: Bodies) -> Array:
    """Velocity of the wheel's lowest point against the plane, along the plane."""
    plane, n = word.ground, len(bodies.told)
    R = np.broadcast_to(np.eye(3), (n, 3, 3)) if plane.frame is None else bodies.frame(plane.frame).H[:, :3, :3]
    normal = np.asarray(plane.normal)
    place = bodies.place(word.center) - bodies.told.parameters[f"{word.name}.radius"] * (R @ normal)
    v = bodies.velocity(word.center.body.name, place) - R @ np.asarray(plane.velocity)
    if plane.frame is not None:
        v = v - bodies.velocity(plane.frame.body.name, place)
    return np.asarray(np.sum(v * (R @ np.cross(normal, [0.0, 0.0, 1.0])), axis=1))


def contacts(found: Faults, bodies: Bodies, acting: Loads, run: Any) -> None:
    """Gaps, pushes and friction of contacts; dry friction in joints.

    What the run tells in a note about penetration or pull is not counted, nor are rates next to singular poses.
    """
    told, size = bodies.told, size_of(bodies)
    notes = " ".join(map(str, run.stats["notes"]))
    located = run.settings["contact"] != "nonsmooth" and "index3" not in run.settings["integrator"]
    largest = np.max([load.force_size for load in acting.on.values()], axis=0, initial=1e-9)
    contacts: list[Any] = bodies.model.contacts  # Unilateral and Penalty
    for word in contacts:
        gap = gap_of(word.measure, bodies)
        closed, force = told.closed[word.name], told[f"{word.name}.force"]
        off = gap.value - told[f"{word.name}.gap"]
        found.small("gap as reported", word.name, off, EQUAL * size + ROUND_OFF * gap.blur**2)
        fast = size * (1.0 + sum(np.abs(motion.angular).max(axis=1) for motion in map(bodies.twist, acting.on)))
        rate = gap.rate(bodies)
        found.small(
            "gap rate as reported",
            word.name,
            rate - told[f"{word.name}.gap_rate"],
            EQUAL * (fast + np.abs(rate)) + ROUND_OFF * fast * gap.blur**3,
        )
        found.small("an open contact is without force", word.name, force, 0.0, ~closed)
        if isinstance(word, mbd.Penalty):
            _force_law(found, word, gap, rate, bodies)
            continue
        mentioned = f"{word.name!r}" in notes
        if word.opens_on == "pull":
            found.small(
                "a closed contact does not pull",
                word.name,
                np.minimum(force, 0.0),
                1e-6 * largest,
                closed & ~np.bool_(mentioned),
            )
        found.small("a closed contact touches", word.name, gap.value, HELD * size, closed)
        if located:
            at_poses = int(run.stats["singular_steps"])
            found.small("a closed contact stays", word.name, rate, HELD * (fast + np.abs(rate)), closed, told=at_poses)
        if word.slides and gap.tangents and f"{word.name}.friction" in told:
            slipping = np.linalg.norm([np.sum(gap.slip(bodies) * e, axis=1) for _, e in gap.tangents], axis=0)
            mu = _coefficient(word, slipping, told.parameters)
            limit = np.where(closed, mu * np.maximum(force, 0.0), 0.0)
            if f"{word.name}.friction.sideways" in told:
                _cone(found, word, gap, bodies, limit, largest, located)
                continue
            speed = _sliding(gap, bodies)
            _dry(found, word.name, told[f"{word.name}.friction"], speed, limit, largest, located)
    for joint in bodies.model.joints:
        _joint_friction(found, joint, bodies, largest, located)


def _coefficient(word: Any, speed: Array, parameters: Any) -> Any:
    """μ of a contact at a speed of its slip."""
    if isinstance(word.friction, mbd.Stribeck):
        return _falling(f"{word.name} friction", speed, parameters)
    return parameters[f"{word.name}.mu"]


def _falling(owner: str, speed: Array, parameters: Any) -> Array:
    """Stribeck's T_k + (T_s − T_k) e^{−(v/v_s)²}."""
    static, kinetic, rapid = (parameters[f"{owner}.{field}"] for field in ("static", "kinetic", "speed"))
    return np.asarray(kinetic + (static - kinetic) * np.exp(-((speed / rapid) ** 2)))


def _force_law(found: Faults, word: mbd.Penalty, measured: Any, rate: Array, bodies: Bodies) -> None:
    """p = k δⁿ + c δ̇ of a penalty without a restitution of its own, but at kinks of g, where ġ jumps."""
    told, gap, smooth = bodies.told, measured.value, measured.blur < KINK + np.zeros(len(bodies.told))
    force, closed = told[f"{word.name}.force"], told.closed[word.name]
    if word.opens_on == "pull":
        found.small(
            "a closed contact does not pull",
            word.name,
            np.minimum(force, 0.0),
            1e-6 * np.max(np.abs(force), initial=1.0),
            smooth,
        )
    if word.chi is not None:
        return
    stiffness, damping = told.parameters[f"{word.name}.stiffness"], told.parameters[f"{word.name}.damping"]
    pressed = stiffness * np.maximum(-gap, 0.0) ** word.exponent
    off = np.where(closed, pressed - damping * rate, 0.0) - force
    scale = np.abs(pressed) + np.abs(damping * rate) + stiffness * 1e-9
    turned = ROUND_OFF * (stiffness * measured.blur**2 + damping * (1.0 + np.abs(rate)) * measured.blur**3)
    found.small("force law of a penalty", word.name, off, 1e-7 * scale + turned, closed & (gap < 0.0) & smooth)


def _sliding(gap: Any, bodies: Bodies) -> Array:
    """Velocity of the point against the surface along the first tangent."""
    return np.asarray(np.sum(gap.slip(bodies) * gap.tangents[0][1], axis=1))


def _cone(found: Faults, word: Any, gap: Any, bodies: Bodies, limit: Any, largest: Array, located: bool) -> None:
    """|F| ≤ μ p in the plane of contact; where it slides F = −μ p γ/|γ|."""
    told, slip = bodies.told, gap.slip(bodies)
    parts = {part: f"{word.name}.friction.{part}" for part, _ in gap.tangents}
    force = np.stack([told[name] if name in told else 0.0 * limit for name in parts.values()], axis=1)
    speeds = np.stack([np.sum(slip * direction, axis=1) for _, direction in gap.tangents], axis=1)
    size, speed = np.linalg.norm(force, axis=1), np.linalg.norm(speeds, axis=1)
    scale = 1e-5 * (largest + np.max(np.abs(limit), initial=0.0))
    lag = 0.0 if located else 0.02 * _change(size - limit)
    found.small("friction within its cone", word.name, np.maximum(size - limit, 0.0), scale + lag)
    if not located:
        return
    wanted = -limit[:, None] * speeds / np.where(speed > 0.0, speed, 1.0)[:, None]
    off = np.linalg.norm(force - wanted, axis=1)
    scale = scale + limit * BEGINNING / np.where(speed > 0.0, speed, 1.0)
    found.small("sliding friction is against the velocity, all of it", word.name, off, scale, speed > 1e-4)


def _joint_friction(found: Faults, joint: Any, bodies: Bodies, largest: Array, located: bool) -> None:
    told = bodies.told
    for k, label in enumerate(joint.freedoms):
        name = f"{joint.name}.{label.name}"
        friction = next((n for n in (f"{name}.friction", f"{joint.name}.friction") if n in told), None)
        if friction is None:
            continue
        limit = np.zeros(len(told))
        load = np.linalg.norm(told.vector(f"{joint.name}.reaction_force"), axis=1)
        for place, owner, loss in joint.losses():
            if place == k:
                limit = limit + _limit(loss, owner, load, told.parameters, told[joint.velocity_names[k]])
        _dry(found, friction, told[friction], told[joint.velocity_names[k]], limit, largest, located)


def _limit(loss: Any, owner: str, load: Array, parameters: Any, rate: Array) -> Any:
    """Largest friction of a loss that truly sticks."""
    if isinstance(loss, mbd.Stribeck):
        return _falling(owner, rate, parameters)
    if isinstance(loss, mbd.PinFriction):
        return parameters[f"{owner}.mu"] * parameters[f"{owner}.radius"] * load
    if isinstance(loss, mbd.Coulomb) and loss.smoothing is None:
        return parameters[f"{owner}.torque"]
    if hasattr(loss, "losses"):
        return sum(_limit(part, name, load, parameters, rate) for name, part in loss.named(owner))
    return 0.0


def _dry(found: Faults, name: str, friction: Array, rate: Array, limit: Any, largest: Array, located: bool) -> None:
    """|F| ≤ limit; where it is located when sliding begins and ends, F against the motion and all of it in motion."""
    scale = 1e-5 * (largest + np.max(np.abs(limit), initial=0.0))
    excess = np.abs(friction) - limit
    lag = 0.0 if located else 0.02 * _change(excess)  # index 3 judges before it corrects velocities
    found.small("friction within its limit", name, np.maximum(excess, 0.0), scale + lag)
    if not located:
        return
    found.small("friction opposes sliding", name, np.maximum(friction * np.sign(rate), 0.0), scale, np.abs(rate) > 1e-6)
    moving = np.abs(rate) > 1e-4
    found.small("sliding friction is all of it", name, np.abs(friction) - limit, scale, moving)


def _change(values: Array) -> Array:
    """The larger change of each value from the one before and to the one after."""
    steps = np.abs(np.diff(values))
    return np.asarray(np.maximum(np.append(steps, 0.0), np.append(0.0, steps)))


def energies(found: Faults, bodies: Bodies, acting: Loads) -> tuple[Array, Array]:
    """T and the change of V are those of the bodies and springs; returns T and V (n,) [J]."""
    told = bodies.told
    T = np.zeros(len(told))
    for name in acting.on:
        mass = mass_of(bodies.model.bodies[name], told.parameters)
        R, motion = bodies.placed[name].H[:, :3, :3], bodies.twist(name)
        v = motion.linear + cross(motion.angular, R @ mass.center)
        local = (np.swapaxes(R, 1, 2) @ motion.angular[:, :, None])[:, :, 0]
        T = T + 0.5 * mass.mass * np.sum(v * v, axis=1) + 0.5 * np.sum(local * (local @ mass.inertia), axis=1)
    V = sum(acting.stored.values(), start=np.zeros(len(told)))
    scale = np.max(np.abs(T), initial=0.0) + sum(np.max(np.abs(part), initial=0.0) for part in acting.stored.values())
    if "kinetic_energy" in told:
        found.small("kinetic energy", "kinetic_energy", T - told["kinetic_energy"], EQUAL * scale + 1e-12)
        off = (V - V[:1]) - (told["potential_energy"] - told["potential_energy"][:1])
        found.small("potential energy", "potential_energy", off, 10.0 * EQUAL * scale + 1e-12)
    return T, V
