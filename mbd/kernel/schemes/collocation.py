"""The numbers of the three-stage Radau IIA method (Hairer & Wanner 1996, Solving ODEs II, IV.5 and IV.8).

``Y_i = y₀ + h Σ a_ij f(Y_j)`` at the points c_i of a step; ``A = T Λ T⁻¹`` with one real eigenvalue and a pair.
"""

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.kernel.algebra.roots import sqrt


@dataclass(frozen=True, eq=False)
class Collocation:
    """Coefficients of a step.

    c (3,) points; A (3, 3) weights; real, pair : eigenvalues of A; t_real, t_pair (3,) their vectors, columns of T;
    s_real, s_pair (3,) rows of T⁻¹; e (3,) weights of Y_i − y₀ in the embedded error
    ``real h f(y₀) + Σ e_i (Y_i − y₀)`` (eq. IV.8.19).
    """

    c: Vector
    A: Matrix
    real: float
    pair: complex
    t_real: Vector
    s_real: Vector
    t_pair: np.ndarray[tuple[int], np.dtype[np.complex128]]
    s_pair: np.ndarray[tuple[int], np.dtype[np.complex128]]
    e: Vector

    def numbers(self) -> Vector:
        """As the kernel reads them in a row: c | A | A A | eigenvalues | t, s | t, s of the pair | e | A⁻¹."""
        pair = [self.pair.real, self.pair.imag]
        parts = [self.c, self.A.ravel(), (self.A @ self.A).ravel(), np.array([self.real, *pair])]
        parts += [self.t_real, self.s_real]
        parts += [self.t_pair.real, self.t_pair.imag, self.s_pair.real, self.s_pair.imag, self.e]
        parts.append(np.linalg.inv(self.A).ravel())
        return np.concatenate(parts)


def radau_iia() -> Collocation:
    """The method of order 5, whose last point is the end of the step."""
    root = sqrt(6.0)
    c = np.array([(4.0 - root) / 10.0, (4.0 + root) / 10.0, 1.0])
    A = np.array([
        [(88.0 - 7.0 * root) / 360.0, (296.0 - 169.0 * root) / 1800.0, (-2.0 + 3.0 * root) / 225.0],
        [(296.0 + 169.0 * root) / 1800.0, (88.0 + 7.0 * root) / 360.0, (-2.0 - 3.0 * root) / 225.0],
        [(16.0 - root) / 36.0, (16.0 + root) / 36.0, 1.0 / 9.0],
    ])  # fmt: skip
    third = 3.0 ** (1.0 / 3.0)
    real = 1.0 / (3.0 + third * third - third)
    pair = 1.0 / complex(3.0 + 0.5 * (third - third * third), 0.5 * (3.0 ** (5.0 / 6.0) + 3.0 ** (7.0 / 6.0)))
    t_real, t_pair = (np.cross((A - value * np.eye(3))[0], (A - value * np.eye(3))[1]) for value in (real, pair))
    t_real, t_pair = t_real / t_real[2], t_pair / t_pair[2]
    left = [np.cross((A - value * np.eye(3))[:, 0], (A - value * np.eye(3))[:, 1]) for value in (real, pair)]
    s_real, s_pair = left[0] / (left[0] @ t_real), left[1] / (left[1] @ t_pair)
    e = real / 3.0 * np.array([-13.0 - 7.0 * root, -13.0 + 7.0 * root, -1.0])
    return Collocation(c, A, real, pair, t_real, s_real, t_pair, s_pair, e)


RADAU = radau_iia()
