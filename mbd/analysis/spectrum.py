"""Stability, damping and period of an integrator at one ω dt.

On ``ü + 2 ξ ω u̇ + ω² u = 0`` a step multiplies what a scheme carries by its amplification matrix. Its eigenvalues z
say all (Hughes 1987, The Finite Element Method, ch. 9; Hilber, Hughes & Taylor 1977, Earthq. Eng. Struct. Dyn. 5:283)::

    ρ = max |z|,   ξ̄ = −ln|z|/arg z,   T̄/T − 1 = ω dt √(1−ξ²)/arg z − 1

with z of the principal pair in the last two.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.analysis.amplification import amplification_matrix
from mbd.bodies.values import is_number, is_several, shown
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.integrators.base import Integrator

MAX_OMEGA_DT = 1e6
"""Largest ω dt that can be told from round-off [rad]."""
NYQUIST = float(np.pi)
"""ω dt beyond which two steps are longer than a period, so that neither period nor damping ratio means anything."""


@dataclass(frozen=True)
class Spectrum:
    """What the eigenvalues of the amplification matrix say at one ω dt.

    radius : ρ; principal : z of the pair that is the oscillation, with positive imaginary part, NaN if all z are real
    damping : what −ln|z|/arg z exceeds that of the oscillator, ξ/√(1−ξ²), by: the algorithmic damping ratio
    elongation : ω dt √(1−ξ²)/arg z − 1, relative period elongation; both NaN beyond ω dt = π
    roots : all eigenvalues but zeros
    """

    turn: float
    radius: float
    principal: complex
    damping: float
    elongation: float
    roots: tuple[complex, ...]


def spectrum(integrator: Integrator, turn: float, damping: float = 0.0) -> Spectrum:
    """Spectral radius, algorithmic damping and period elongation at one ω dt.

    Parameters
    ----------
    integrator : any scheme of the interface
    turn : ω dt > 0 [rad]; damping : ξ of the oscillator, 0 ≤ ξ < 1 [-]

    Raises
    ------
    CapabilityError
        if a step fails or is not linear on a linear oscillator.

    Examples
    --------
    >>> import mbd
    >>> found = spectrum(mbd.Newmark(), 1.0)
    >>> print(f"{found.radius:.6f} {abs(found.damping):.6f} {found.elongation:.6f}")
    1.000000 0.000000 0.078405
    """
    faults = argument_faults(integrator, [turn], damping)
    if faults:
        raise ModelError(faults)
    damping = float(damping)
    roots = np.linalg.eigvals(amplification_matrix(integrator, turn, damping)).astype(complex)
    swing = np.sqrt(1.0 - damping**2)
    pairs = [z for z in roots if z.imag > 1e-9 * abs(z)]
    principal = min(pairs, key=lambda z: abs(z - np.exp(turn * (-damping + 1j * swing))), default=complex(np.nan))
    angle = float(np.angle(principal)) if turn <= NYQUIST else np.nan
    return Spectrum(
        turn, float(np.max(np.abs(roots))), complex(principal),
        float(-np.log(abs(principal)) / angle - damping / swing), float(turn * swing / angle - 1.0),
        tuple(complex(z) for z in roots),
    )  # fmt: skip


def argument_faults(integrator: Any, turns: Sequence[float], damping: float) -> list[str]:
    """What is wrong with an integrator, ω dt and ξ."""
    faults = []
    if not isinstance(integrator, Integrator):
        faults.append(f"an integrator is expected, such as mbd.HHT(0.05), not {integrator!r}")
    several = is_several(turns) and isinstance(turns, Sequence | np.ndarray) and len(turns) > 0
    if not several or not all(is_number(turn) and 0.0 < turn <= MAX_OMEGA_DT for turn in turns):
        faults.append(f"turns (ω dt) must be a list of numbers above 0 and up to {MAX_OMEGA_DT:g}, not {shown(turns)}")
    if not is_number(damping) or not 0.0 <= damping < 1.0:
        faults.append(f"damping, the ratio of the oscillator, must lie in 0 ≤ ξ < 1, not {shown(damping)}")
    return faults
