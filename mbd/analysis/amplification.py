"""What one step of any integrator does to the linear oscillator, found by stepping it.

A step of a linear oscillator is linear in all that the scheme carries from step to step: position, velocity and the
numbers in its memory. Unit changes of each give the matrix.
"""

import dataclasses
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError
from mbd.integrators.base import Integrator, Point, System, Terms
from mbd.state import Mode, State

SUPERPOSITION, ROUND_OFF = 1e-4, 4e-15
"""Difference of a step from the sum of its parts, relative, above which the scheme is not linear; and the part of it
that round-off explains where accelerations are (ω dt)² times displacements [-]."""
INFLUENCE_RTOL = 1e-13
"""Influence on the next step, relative to the largest, below which a number in the memory has none [-]."""

MODE = Mode()


@dataclass(frozen=True)
class LinearOscillator(System):
    """``ü + 2 ξ ω u̇ + ω² u = 0`` as an integrator sees a mechanism.

    frequency : ω [rad/s]; damping : ξ [-]
    """

    frequency: float
    damping: float = 0.0
    constant_mass = True

    def evaluate(self, point: Point, mode: Mode, tangent: tuple[float, float] | None) -> Terms:
        """Balance and tangent at a point."""
        c, k = 2.0 * self.damping * self.frequency, self.frequency**2
        r = point.rate + c * point.y + k * (point.q + point.x)
        return Terms(r, None if tangent is None else np.array([[1.0 + c * tangent[0] + k * tangent[1]]]))

    def exact(self, time: float) -> Matrix:
        """(2, 2) what a time does to (u, u̇/ω)."""
        from scipy.linalg import expm

        w = self.frequency
        return np.asarray(expm(w * time * np.array([[0.0, 1.0], [-1.0, -2.0 * self.damping]])))


def oscillated(integrator: Integrator, turn: float, damping: float, start: Vector, steps: int) -> list[Any]:
    """(state, memory) at the start (u, u̇/ω) and after each step of dt = 1 s, with ω = `turn` rad/s."""
    system = LinearOscillator(turn, float(damping))
    state = State(0.0, np.array([start[0]]), np.array([turn * start[1]]))
    run = [(state, integrator.start(system, state, MODE, 1.0))]
    for _ in range(steps):
        run.append(_stepped(integrator, system, *run[-1]))
    return run


def amplification_matrix(integrator: Integrator, turn: float, damping: float = 0.0) -> Matrix:
    """What one step does to all that a scheme carries, (k, k) with k ≥ 2: the eigenvalues are those of the step.

    Identified by unit changes, one step each, and checked by superposition. Numbers in the memory that never differ
    are left as they are; directions that one step wipes out are left out, as zero eigenvalues say nothing.

    Parameters
    ----------
    integrator : any scheme with `start` and `step`; its memory may be any nest of arrays, tuples and dataclasses
    turn : ω dt [rad]
    damping : ξ of the oscillator [-]

    Raises
    ------
    CapabilityError
        if a step fails, or is not linear in what the scheme carries.
    """
    system = LinearOscillator(turn, float(damping))
    # steps after which the memory of a scheme has its final shape, a multistep scheme with up to so many steps
    runs = [oscillated(integrator, turn, damping, np.array(start), 4) for start in ((1.0, 0.0), (0.3, 1.0))]
    states = [_numbers(*each) for run in runs for each in run]
    seen = np.array([numbers for numbers in states if len(numbers) == len(states[-1])])
    last = runs[0][-1]
    sizes = np.max(np.abs(seen), axis=0)
    carried = np.flatnonzero(np.any(np.abs(seen - seen[0]) > 1e-14 * sizes, axis=0) & (sizes > 0.0))
    scale, base = sizes[carried], _numbers(*last)

    def step(change: Vector) -> Vector:
        inputs = base.copy()
        inputs[carried] += scale * change
        return np.asarray(_numbers(*_stepped(integrator, system, *_filled(last, inputs)))[carried] / scale)

    after = step(np.zeros(len(carried)))  # changes are made about a motion: a state of rest has no scale to judge by
    matrix = np.array([step(unit) - after for unit in np.eye(len(carried))]).T
    mixed = np.random.default_rng(5).uniform(-1.0, 1.0, len(carried))
    parts = step(mixed) - after - matrix @ mixed, after - matrix @ (base[carried] / scale)
    enters = np.any(matrix != 0.0, axis=0)  # what the next step does not read, as an error estimate, need not be linear
    matrix = matrix[np.ix_(enters, enters)]
    off = float(np.max(np.abs([part[enters] for part in parts]), initial=0.0))
    if not off <= (SUPERPOSITION + ROUND_OFF * turn**2) * max(1.0, float(np.max(np.abs(matrix), initial=0.0))):
        raise CapabilityError(
            f"a step of {integrator!r} with ω dt = {turn:g} is not linear in position, velocity and memory (off by "
            f"{off:.1e}), so that it has no amplification matrix"
        )
    return _reduced(matrix)


def _stepped(integrator: Integrator, system: LinearOscillator, state: State, memory: Any) -> Any:
    """(state, memory) after one step of 1 s."""
    result = integrator.step(system, replace(state, time=0.0), 1.0, MODE, memory)
    if not result.report.converged:
        raise CapabilityError(
            f"{integrator!r} does not step a linear oscillator with ω dt = {system.frequency:g}: "
            f"{result.report.message or 'it did not converge'}"
        )
    return result.state, result.memory


def _reduced(matrix: Matrix) -> Matrix:
    """The same without directions of eigenvalue zero: those that nothing follows from, and those that nothing reaches.

    First the numbers that do not enter the next step, then the directions outside the range, until nothing is left out.
    """
    while len(matrix):
        influence = np.max(np.abs(matrix), axis=0)
        kept = influence > INFLUENCE_RTOL * np.max(influence)
        matrix = matrix[np.ix_(kept, kept)]
        left, sizes, _ = np.linalg.svd(matrix)
        rank = int(np.count_nonzero(sizes > INFLUENCE_RTOL * np.max(sizes, initial=0.0)))
        if rank == len(matrix):
            return matrix if rank else np.zeros((1, 1))
        matrix = left[:, :rank].T @ matrix @ left[:, :rank]
    return np.zeros((1, 1))


# memories as lists of numbers -------------------------------------------------------------------------------------
def _numbers(state: State, memory: Any) -> Vector:
    """Position, velocity, and every real number in a memory, in the order of its fields."""
    found = [float(state.q[0]), float(state.v[0])]
    _walk(memory, found, None)
    return np.array(found)


def _filled(run: Any, numbers: Vector) -> Any:
    """(state, memory) with other numbers."""
    state, memory = run
    return replace(state, q=numbers[:1].copy(), v=numbers[1:2].copy()), _walk(memory, [], iter(numbers[2:].tolist()))


def _walk(value: Any, found: list[float], given: Any) -> Any:
    """The value with its real numbers appended to `found`, or replaced by `given` ones; integers and words stay.

    So do fields of dataclasses with the metadata ``{"carried": False}``, which no motion is made of.
    """
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        if given is None:
            found += value.ravel().tolist()
            return value
        return np.array([next(given) for _ in range(value.size)]).reshape(value.shape)
    if isinstance(value, float):
        found.append(float(value))
        return value if given is None else next(given)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        carried = [each.name for each in dataclasses.fields(value) if each.metadata.get("carried", True)]
        parts = {name: _walk(getattr(value, name), found, given) for name in carried}
        return value if given is None else replace(value, **parts)
    if isinstance(value, dict):
        return {key: _walk(part, found, given) for key, part in value.items()}
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return type(value)(*(_walk(part, found, given) for part in value))
    if isinstance(value, tuple | list):
        return type(value)(_walk(part, found, given) for part in value)
    return value
