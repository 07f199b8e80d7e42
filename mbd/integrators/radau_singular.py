"""Steps of Radau IIA with stages on both sides of a singular configuration: see `mbd.kernel.singular.stages`."""

from __future__ import annotations

import numpy as np

from mbd.arrays import Vector
from mbd.integrators.base import StepResult
from mbd.integrators.radau_step import EPS, MAX_ITERATIONS, RadauStep, infinite_unless_number
from mbd.kernel.schemes.radau import PATIENT, SLOW, has_converged
from mbd.kernel.singular.stages import MOST_STAGE_PROJECTIONS

__all__ = ["SingularRadauStep"]


class SingularRadauStep(RadauStep):
    """A step in which positions and multipliers of each stage are held to rows of its own."""

    at_singularity = True

    def run(self) -> StepResult:
        """Positions and multipliers settle stage by stage; Newton corrects rates, with new matrices each time."""
        before, first, last, moved = np.inf, 0.0, 0.0, np.inf
        error = np.inf
        for iteration in range(MAX_ITERATIONS):
            try:
                quick = np.array([self._project_stage(i) for i in range(3)])
            except np.linalg.LinAlgError:
                return self._failed(iteration, error, "the rows depend on each other at a stage")
            terms = [self._terms(i) for i in range(3)]
            error = max(infinite_unless_number(self._error(i, each)) for i, each in enumerate(terms))
            if not np.isfinite(error):
                return self._failed(iteration, error, "a force or a row is not finite")
            matrices = self._matrices(len(terms[0].h))
            if error <= 1.0 and iteration > 0 and has_converged(moved, last, first):
                return self._completed(matrices, iteration, error)
            if error > 1.0 and iteration > 2 and error > SLOW * before:
                if error * self.tolerance <= self.upper:
                    return self._completed(matrices, iteration, error)
                if iteration >= PATIENT:
                    break
            before, last = error, moved
            r, n = np.array([each.r for each in terms]), len(self.y0)
            try:
                moved = self._correct_rates(r, -quick @ matrices.real[n:, :n].T, matrices)
            except np.linalg.LinAlgError:
                return self._failed(iteration, error, "the Newton matrix is singular")
            if iteration == 0:
                first, last = moved, 0.0
                self.tolerance = min(self.upper, max(1e-3 * first**2, self.tolerance))
        return self._failed(MAX_ITERATIONS, error, "Newton did not converge")

    def _project_stage(self, i: int) -> Vector:
        """U_i and λ_i at the rates of stage i; the least change of velocities (n,) that does away with ḣ."""
        n, n_v, before = len(self.y0), self.n_v, np.inf
        self.U[i] = 0.0
        for turn in range(MOST_STAGE_PROJECTIONS):
            terms = self._terms(i, (0.0, 0.0))
            M, R, m = np.asarray(terms.S), np.asarray(terms.R), len(terms.h)
            if not np.isfinite(np.concatenate([terms.r, terms.h])).all():
                return np.zeros(n)
            B = np.zeros((m, n))
            H = np.asarray(terms.H)
            B[:, : H.shape[1]] = H
            matrix = np.block([[M, B.T], [B, np.zeros((m, m))]])
            held = np.zeros(m, dtype=bool) if terms.velocity is None else np.asarray(terms.velocity)
            h = np.where(held, 0.0, terms.h)
            scale = 1.0 if terms.scale_h is None else terms.scale_h
            size = float(np.max(np.abs(h) / (16.0 * EPS * scale + 1e-300)))
            if turn > 0 and (size <= 1.0 or size >= before):
                break
            before = size
            self.U[i] -= np.linalg.solve(matrix, np.concatenate([np.zeros(n), h]))[:n_v]
        quick = -np.linalg.solve(matrix, np.concatenate([np.zeros(n), terms.rate]))[:n]
        matrix[:n, n:] = R
        self.lam[i] -= np.linalg.solve(matrix, np.concatenate([terms.r, np.zeros(m)]))[n:]
        return np.asarray(quick)
