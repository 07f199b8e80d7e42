"""Moments from motion: the equations of motion read backwards, frame by frame."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.bodies.point_mass import PointMass
from mbd.bodies.values import named_number_faults, names_of
from mbd.compile.many import at_inputs
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.equations.equations import Equations
from mbd.equations.inputs import Inputs
from mbd.equations.programs import loaded_balance, row_forces
from mbd.errors import CapabilityError, ModelError, nearest
from mbd.joints.base import Joint
from mbd.joints.free import Free
from mbd.joints.planar import Planar
from mbd.joints.translation import Translation
from mbd.laboratory.balance_result import InverseDynamics
from mbd.laboratory.force_plate import ForcePlate, all_plates, loaded_model, wrenches
from mbd.laboratory.least_norm import Balanced, balanced
from mbd.laboratory.motion import Motion, motion_of
from mbd.laboratory.motion_record import parameters_of, record_of
from mbd.laboratory.pins import Pin, pin_moments, without_pins
from mbd.laboratory.scatter import noise_remarks
from mbd.notes import doubt
from mbd.results.columns import ModelColumns
from mbd.results.record import Record
from mbd.results.trajectory import Trajectory
from mbd.tape.derivatives import live
from mbd.tape.node import Node
from mbd.topology.plan import plan

MAX_LOADS, SETTLED = 60, 1e-13
"""How often forces in pins and their friction are solved for in a loop, and the change at which that ends [-]."""


def inverse_dynamics(
    model: Any,
    motion: Any,
    joints: Sequence[str] | None = None,
    *,
    plates: Sequence[ForcePlate] = (),
    parameters: Mapping[str, float] | None = None,
    backend: str = "auto",
) -> InverseDynamics:
    """Moments, powers, reactions and residuals of a motion, frame by frame, without a simulation.

    ``M v̇ + f(t, q, v) + Rλ = τ + ρ``: all forces that the model describes act (weight, losses, springs, motors), τ is
    what must act at the driven joints besides them, λ are the multipliers of the rows of closed loops and of
    constraints, and ρ, the residual, is what the balance lacks where nothing drives. A perfect recording of a
    floating body with all its contact forces has no residual.

    1. Velocities and accelerations come from the run, or from splines through the values.
    2. Machine code evaluates ``g = M v̇ + f`` with all known forces at every frame; its cost is that of one recursive
       Newton–Euler sweep (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, section 5.3).
    3. Without rows ``τ = g`` at the driven coordinates and ``ρ = g`` at the others. With rows ρ is made as small as it
       can be, then τ, then λ, each of least norm; `InverseDynamics.notes` says where that was needed.

    The friction of pins follows from the forces in their joints, and is zero where a pin is at rest.

    The contacts of a run push with the forces of the run; those of a recorded motion are open, so that their forces are
    part of ρ.

    Parameters
    ----------
    model : a `Model` or a `Lagrangian`
    motion : a run; the result of `mbd.inverse_kinematics`; a `Recording` whose channels have the names of coordinates;
        or arrays by name, {'time': t (R,), 'left hip.angle': (R,),
        'trunk.orientation': (R, 4), …} [s, m, rad], or `Samples`; rates and accelerations may be given too
        ('left hip.angle.rate'), coordinates that closed loops determine may be left out. Noise in the values scatters
        accelerations by 6 σ/h², h the distance of frames, of which an `MbdWarning` tells; smooth them before:
        ``Samples(time, values, kind="smooth")``, ``recording.smoothed(cutoff=6.0)``, `inverse_kinematics` with cutoff
    joints : names of the joints that are driven; by default all but those with which a body floats over the ground
        (`Free`, in the plane `Planar`, of a point mass `Translation`)
    plates : force plates with the feet that stand on them, in the place of all contacts (`mbd.ForcePlate`,
        `mbd.assign_plates`)
    parameters : values that differ from those of the model
    backend : 'auto', 'llvm' or 'python'

    Raises
    ------
    ModelError
        for a motion that is not one of this model, gaps, joints that are cut or that the model lacks.
    CapabilityError
        for states of forces of a recorded motion, and for friction that follows the force of a joint of several
        coordinates, or of one that closes a loop.

    Examples
    --------
    A pendulum that is held out level needs the moment m g l:

    >>> import mbd
    >>> model = mbd.Model("arm")
    >>> rod = mbd.Link("rod", mass=2.0, length=1.0, center=0.5)
    >>> model.connect(mbd.Revolute("shoulder", model.ground.origin, rod.start))
    >>> held = mbd.inverse_dynamics(model, {"time": [0.0], "shoulder.angle": [1.5707963267948966]})
    >>> print(f"{held['shoulder.moment'][0]:.2f} N m")
    9.81 N m
    """
    if faults := named_number_faults(parameters, "parameters"):
        raise ModelError(faults)
    plates = all_plates(plates)
    bare, pins = without_pins(model)
    loaded = loaded_model(bare, plates)
    mechanism = mechanism_of(loaded, backend, parameters)
    found = motion_of(loaded, mechanism, motion, parameters or {})
    if plates:
        found = replace(found, run=None)
    values = parameters_of(mechanism, found, parameters or {}, loaded)
    if plates:
        values = np.tile(values, (len(found.time), 1))
        places = {each.name: k for k, each in enumerate(mechanism.equations.parameters)}
        for name, column in wrenches(plates, found.time).items():
            if name in places:  # those that push sideways are in no equation of the plane
                values[:, places[name]] = column
    return dynamics_of(loaded, mechanism, found, values, joints, plates, pins, parameters or {})


def dynamics_of(
    model: Any,
    mechanism: Mechanism,
    motion: Motion,
    parameters: Vector | Matrix,
    joints: Sequence[str] | None,
    plates: Sequence[ForcePlate] = (),
    pins: Sequence[Pin] = (),
    changed: Mapping[str, float] | None = None,
) -> InverseDynamics:
    """The balance of a motion whose parameters are known at each frame."""
    equations = mechanism.equations
    owners = mechanism.kept(_joints, lambda: _joints(model, equations))
    driven = _driven(model, owners, equations.n_v, joints)
    record = record_of(mechanism, motion, parameters)
    columns = ModelColumns(record, equations)
    g, R = _forces(mechanism, columns.all_inputs(columns.rows), parameters)
    friction, notes = np.zeros(g.shape), list[str]()  # which nothing fills where no pin rubs
    found = balanced(g.copy() if pins else g, R, driven)
    run = _moved(record, equations, found)
    for _ in range(MAX_LOADS if pins else 0):
        # what pins rub follows from the forces in them, which in loops follow from what they rub
        last = friction
        friction, notes = pin_moments(pins, run, equations.velocity_names, changed or {})
        found = balanced(g - friction, R, driven)
        run = _moved(record, equations, found)
        if np.abs(friction - last).max() <= SETTLED * np.abs(friction).max(initial=0.0) or not R.shape[2]:
            break
    else:
        if pins:
            raise CapabilityError(
                f"inverse dynamics: the friction of '{pins[0].joint}' and the forces of the loop do not settle; leave "
                f"it out by model.without('{pins[0].joint} loss')"
            )
    recorded = motion.run is None and motion.differentiated
    noisy = noise_remarks(equations, motion, found.effort, driven) if recorded else []
    doubt(*noisy, of=model)
    remarks = [*motion.notes, *noisy, *notes]
    remarks += _notes(equations, found.free, found.shared, driven, motion, bool(plates))
    return InverseDynamics(run, owners, driven, found.effort, found.residual, tuple(remarks), plates, friction)


def _moved(record: Record, equations: Equations, found: Balanced) -> Trajectory:
    """The motion as a run with these multipliers."""
    lam = record.lam.copy()
    lam[:, list(equations.bilateral)] = found.lam
    return Trajectory(
        replace(record, lam=lam, message="motion that was given", settings={"method": "inverse dynamics"})
    )


def _forces(
    mechanism: Mechanism, inputs: Mapping[str, Any], parameters: Vector | Matrix
) -> tuple[Matrix, NDArray[np.float64]]:
    """g (R, n_v) and R (R, n_v, m) of the rows that always act, whose multipliers are zero in the inputs."""
    equations, n_v, m = mechanism.equations, mechanism.equations.n_v, len(mechanism.equations.bilateral)

    def made() -> Any:
        functions = mechanism.backend.functions(mechanism.layout)
        functions.add({"inverse_dynamics": _program(equations)})
        return functions["inverse_dynamics"]

    out = at_inputs(mechanism.kept(_program, made), mechanism.layout, inputs, parameters)
    return out[:, :n_v], out[:, n_v:].reshape(len(out), m, n_v).transpose(0, 2, 1)


def _program(equations: Equations) -> list[Node]:
    """g | R, column by column.

    Raises
    ------
    CapabilityError
        where forces depend on the multipliers of these rows by more than R.
    """
    r = loaded_balance(equations)
    rows = list(equations.bilateral)
    columns = row_forces(equations, r, rows) if rows else []
    wide = [entry for column in columns for entry in column[: equations.n_v]]
    inputs = Inputs.of(equations)
    own = {inputs.lam[k].index for k in rows}
    if any(node.index in own for node in live(wide)) or _follows(equations, own):
        raise CapabilityError(
            "inverse dynamics: friction follows the force of a joint or a constraint, which the motion alone does not "
            "tell; leave it out by model.without('… loss')"
        )
    return [*r[: equations.n_v], *wide]


def _follows(equations: Equations, own: set[int]) -> bool:
    limits = [friction.sliding for friction in equations.frictions if friction.contact < 0]
    return any(node.index in own for node in live(limits)) if limits else False


# joints -------------------------------------------------------------------------------------------------------------
def _joints(model: Any, equations: Equations) -> list[tuple[Joint | None, str, tuple[int, ...]]]:
    """(joint, name, numbers of its velocities) of the coordinates, those that no joint owns each by itself."""
    names = equations.velocity_names
    if not hasattr(model, "joints"):
        return [(None, name.removesuffix(".rate"), (k,)) for k, name in enumerate(names)]
    found: list[tuple[Joint | None, str, tuple[int, ...]]] = []
    first = 0
    for joint in plan(model).edges:
        count = len(joint.freedoms)
        if count:
            found.append((joint, joint.name, tuple(range(first, first + count))))
        first += count
    found += [(None, names[k].removesuffix(".rate"), (k,)) for k in range(first, len(names))]
    return found


def _driven(
    model: Any, known: Sequence[tuple[Joint | None, str, tuple[int, ...]]], n_v: int, joints: Sequence[str] | None
) -> NDArray[np.bool_]:
    """Which velocities belong to driven joints."""
    driven = np.zeros(n_v, dtype=bool)
    if joints is None:
        for joint, _, places in known:
            driven[list(places)] = not _floats(model, joint)
        return driven
    names = {name: places for _, name, places in known}
    cut = {joint.name for joint in plan(model).cut} if hasattr(model, "joints") else set()
    for name in names_of(joints, "joints of inverse_dynamics"):
        if name in cut:
            raise ModelError(
                f"joints: {name!r} closes a loop and is cut, so that it has no coordinate of its own; cut another "
                "joint of the loop with cut=['…'] of the model"
            )
        if name not in names:
            raise ModelError(f"joints: {nearest(name, names, 'joint', 'The model has')}")
        driven[list(names[name])] = True
    return driven


def _floats(model: Any, joint: Joint | None) -> bool:
    """Whether a joint lets a body move freely over the ground."""
    if joint is None or joint.parent.body.name != model.ground.name:
        return False
    carried = isinstance(joint, Translation) and isinstance(joint.child.body, PointMass)
    return isinstance(joint, Free | Planar) or carried or len(joint.freedoms) == 6


def _notes(
    equations: Equations, free: int, shared: bool, driven: NDArray[np.bool_], motion: Motion, pushed: bool
) -> list[str]:
    """What a reader must know of the answer."""
    found = []
    if shared:
        found.append(
            f"{int(driven.sum())} driven coordinates share the moments of a loop: those of least norm are given; name "
            "the joints that are driven with joints=[…]"
        )
    elif free:
        count = "a combination" if free == 1 else f"{free} combinations"
        found.append(
            f"{count} of the multipliers of rows has no effect (redundant rows); those of least norm are given"
        )
    if motion.run is None and equations.contacts:
        names = ", ".join(repr(contact.name) for contact in equations.contacts[:4])
        whose = "plates push in their place" if pushed else "their forces are part of the residual"
        found.append(f"contacts are open, {whose}: {names}")
    return found
