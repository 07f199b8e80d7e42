"""Cases i1 to i4: what one step of a scheme does to the linear oscillator, against exact eigenvalues."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import mbd
from mbd.integrators.family import Coefficients, NewmarkFamily
from mbd.state import Mode, State
from tests.cases.oscillators import WBZ, Oscillator, amplification, spectrum
from tests.cases.schemes import name_of
from tests.problems import case

I1, I2, I3, I4 = (
    case(name)
    for name in ("i1-spectral-properties", "i2-asymptotic-coefficients", "i3-hht-beta", "i4-discrete-exactness")
)

SCHEMES: dict[str, NewmarkFamily] = {
    "Newmark trapezoidal (beta 1/4, gamma 1/2)": mbd.Newmark(start="consistent"),
    "Newmark linear acceleration (1/6, 1/2)": mbd.Newmark(beta=1 / 6, gamma=0.5, start="consistent"),
    "Newmark damped (0.3025, 0.6)": mbd.Newmark(beta=0.3025, gamma=0.6, start="consistent"),
    "HHT alpha = 0.05 (chapter text)": mbd.HHT(alpha=0.05, start="consistent"),
    "HHT alpha = 1/3": mbd.HHT(alpha=1 / 3, start="consistent"),
    "HHT alpha = 0.1": mbd.HHT(alpha=0.1, start="consistent"),
    "HHT alpha = 0.3": mbd.HHT(alpha=0.3, start="consistent"),
    "generalized-alpha rho_inf 0.8": mbd.GeneralizedAlpha(0.8, start="consistent"),
    "generalized-alpha rho_inf 0.5": mbd.GeneralizedAlpha(0.5, start="consistent"),
    "generalized-alpha rho_inf 0": mbd.GeneralizedAlpha(0.0, start="consistent"),
    "WBZ rho_inf 0.7": WBZ(0.7),
}
DAMPED = [(name, xi) for name in SCHEMES for xi in (0.0, 0.05) if any(f"{name}, xi={xi:g}" in q for q in I1.quantities)]
TURNS = (0.1, 0.5, 1.0, 2.0)


@pytest.mark.parametrize("name", SCHEMES)
def test_a_scheme_has_the_four_numbers_of_its_family(name: str) -> None:
    c = SCHEMES[name].coefficients
    expected = I1[f"parameters (alpha_m, alpha_f, beta, gamma) | {name}"].value
    assert [c.alpha_m, c.alpha_f, c.beta, c.gamma] == pytest.approx(expected, abs=1e-15)
    assert c.rho_inf == pytest.approx(I1[f"rho_infinity | {name}"].value, abs=1e-14)


@pytest.mark.parametrize(("name", "xi"), DAMPED)
def test_the_spectral_radius_is_that_of_the_exact_amplification_matrix(name: str, xi: float) -> None:
    found = [spectrum(SCHEMES[name], turn, xi).radius for turn in (0.1, 0.5, 1.0, 2.0, 10.0, 1000.0)]
    assert found == pytest.approx(
        I1[f"spectral radius at Omega = w dt = 0.1, 0.5, 1, 2, 10, 1000 | {name}, xi={xi:g}"].value, abs=1e-10
    )


@pytest.mark.parametrize(("name", "xi"), DAMPED)
def test_damping_and_period_are_those_of_the_exact_principal_root(name: str, xi: float) -> None:
    found = [spectrum(SCHEMES[name], turn, xi) for turn in TURNS]
    damping = I1[f"algorithmic damping ratio at Omega = [0.1, 0.5, 1.0, 2.0] | {name}, xi={xi:g}"].value
    elongation = I1[f"relative period elongation T_bar/T - 1 at Omega = [0.1, 0.5, 1.0, 2.0] | {name}, xi={xi:g}"].value
    assert [each.damping for each in found] == pytest.approx(damping, abs=1e-10)
    assert [each.elongation for each in found] == pytest.approx(elongation, abs=1e-10)


@pytest.mark.parametrize("name", SCHEMES)
def test_stiff_modes_keep_the_promised_share_per_step(name: str) -> None:
    """The limit of the radius as ω dt → ∞, by a polynomial in (ω dt)^(−2/3), for a threefold root splits like that."""
    reference, turns = I1[f"rho_infinity | {name}"], 250.0 * 2.0 ** np.arange(5)
    radii = [spectrum(SCHEMES[name], turn).radius for turn in turns]
    limit = np.polynomial.Polynomial.fit(turns ** (-2 / 3), radii, 4)(0.0)
    assert limit == pytest.approx(reference.value, abs=reference.accuracy)


@pytest.mark.parametrize("alpha", [0.0, 0.02, 0.07, 0.17, 0.28])
@pytest.mark.parametrize("rho", [0.0, 0.15, 0.63, 0.97])
@pytest.mark.parametrize("xi", [0.0, 0.13])
def test_any_member_of_the_family_has_the_roots_of_its_written_out_step(alpha: float, rho: float, xi: float) -> None:
    """The three equations of a step solved by hand for other parameters than the published ones."""
    for scheme in (mbd.HHT(alpha, start="consistent"), mbd.GeneralizedAlpha(rho, start="consistent")):
        for turn in (0.3, 1.7, 40.0):
            expected = np.sort_complex(np.linalg.eigvals(written_out(scheme.coefficients, turn, xi)))
            found = np.sort_complex(np.linalg.eigvals(amplification(scheme, turn, xi)))
            assert np.poly(found) == pytest.approx(np.poly(expected), abs=1e-11)


def written_out(k: Coefficients, w: float, xi: float) -> np.ndarray:
    """Left · (u₁, v₁, a₁) = right · (u₀, v₀, a₀) for dt = 1."""
    c, s = 2 * xi * w, w * w
    f, m = k.alpha_f, k.alpha_m
    left = np.array([[1, 0, -k.beta], [0, 1, -k.gamma], [(1 - f) * s, (1 - f) * c, 1 - m]])
    right = np.array([[1, 1, 0.5 - k.beta], [0, 1, 1 - k.gamma], [-f * s, -f * c, -m]])
    return np.linalg.solve(left, right)


# i2: coefficients of the leading errors ---------------------------------------------------------------------------
def extrapolated(value: Callable[[float], float]) -> float:
    """The limit at zero of a function of Ω², from Ω = 0.08, 0.04, 0.02."""
    a, b, c = (value(turn) for turn in (0.08, 0.04, 0.02))
    ab, bc = (4 * b - a) / 3, (4 * c - b) / 3
    return (16 * bc - ab) / 15


@pytest.mark.parametrize("name", SCHEMES)
def test_the_period_error_has_its_asymptotic_coefficient(name: str) -> None:
    reference = I2[f"lim of (T_bar/T - 1)/Omega^2 | {name}"]
    found = extrapolated(lambda turn: spectrum(SCHEMES[name], turn).elongation / turn**2)
    assert found == pytest.approx(reference.value, abs=reference.accuracy)


@pytest.mark.parametrize("name", SCHEMES)
def test_the_numerical_damping_has_its_asymptotic_coefficient(name: str) -> None:
    power = 1 if "damped" in name else 3
    reference = I2[f"lim of damping ratio/Omega{f'^{power}' if power > 1 else ''} | {name}"]
    found = extrapolated(lambda turn: spectrum(SCHEMES[name], turn).damping / turn**power)
    assert found == pytest.approx(reference.value, abs=reference.accuracy)
    assert SCHEMES[name].order() == (1 if power == 1 else 2)


@pytest.mark.parametrize(
    "scheme", [mbd.HHT(0.17), mbd.GeneralizedAlpha(0.33), mbd.GeneralizedAlpha(0.93), WBZ(0.2)], ids=repr
)
def test_any_second_order_member_has_the_coefficients_of_the_general_formulas(scheme: NewmarkFamily) -> None:
    """(12β − 1 + 12 α_f (α_m − α_f))/24 and ½ (α_f − α_m)(β + α_f (α_m − 1)): other parameters than the published."""
    k = scheme.coefficients
    elongation = (12 * k.beta - 1 + 12 * k.alpha_f * (k.alpha_m - k.alpha_f)) / 24
    damping = 0.5 * (k.alpha_f - k.alpha_m) * (k.beta + k.alpha_f * k.alpha_m - k.alpha_f)
    assert extrapolated(lambda turn: spectrum(scheme, turn).elongation / turn**2) == pytest.approx(elongation, abs=1e-6)
    assert extrapolated(lambda turn: spectrum(scheme, turn).damping / turn**3) == pytest.approx(damping, abs=2e-6)


def test_linear_acceleration_becomes_unstable_at_its_critical_step() -> None:
    scheme, critical = mbd.Newmark(beta=1 / 6, start="consistent"), I2["linear acceleration: critical Omega"].value
    assert spectrum(scheme, critical * (1 - 1e-6)).radius == pytest.approx(1.0, abs=1e-12)
    assert spectrum(scheme, critical * (1 + 1e-6)).radius > 1.001


# i3: which beta ---------------------------------------------------------------------------------------------------
class Unsquared(mbd.HHT):
    """HHT with β = (1+α)/4."""

    @property
    def coefficients(self) -> Coefficients:
        return Coefficients(0.0, self.alpha, 0.25 * (1.0 + self.alpha), 0.5 + self.alpha)


def test_hht_squares_its_beta_for_without_the_square_it_is_unstable() -> None:
    alpha = I3.definition["alpha"]
    unsquared, squared = (quantity.value for quantity in I3.quantities.values())
    assert mbd.HHT(alpha).coefficients.beta == 0.25 * (1 + alpha) ** 2
    assert spectrum(mbd.HHT(alpha, start="consistent"), 1e4).radius == pytest.approx(squared, abs=1e-10)
    assert spectrum(Unsquared(alpha, start="consistent"), 1e4).radius == pytest.approx(unsquared, abs=1e-10)
    assert squared < 1.0 < unsquared


@pytest.mark.parametrize("alpha", [0.02, 0.12, 0.3])
def test_any_alpha_is_stable_with_the_square_and_unstable_without(alpha: float) -> None:
    """For ω dt → ∞ the squared β gives (1−α)/(1+α), the other one two real roots of which one is beyond −1."""
    assert spectrum(mbd.HHT(alpha, start="consistent"), 1e4).radius < 1.0
    assert mbd.HHT(alpha).coefficients.rho_inf == pytest.approx((1 - alpha) / (1 + alpha), abs=1e-14)
    assert spectrum(Unsquared(alpha, start="consistent"), 1e4).radius > 1.05


@pytest.mark.parametrize("alpha", [-1e-9, 1 / 3 + 1e-9, 0.5, math.nan])
def test_hht_refuses_an_alpha_for_which_it_is_unstable_or_of_first_order(alpha: float) -> None:
    with pytest.raises(mbd.CapabilityError, match="alpha between 0 and 1/3"):
        mbd.HHT(alpha)


# i4: the discrete solution ----------------------------------------------------------------------------------------
EXACT = {
    "trapezoidal": mbd.Newmark(start="consistent"),
    "HHT 0.05": mbd.HHT(alpha=0.05, start="consistent"),
    "generalized-alpha 0.6": mbd.GeneralizedAlpha(0.6, start="consistent"),
}


@pytest.mark.parametrize("name", EXACT)
def test_fifty_steps_give_the_discrete_solution_to_round_off(name: str) -> None:
    w, xi, dt, steps = (I4.definition[each] for each in ("w", "xi", "dt", "steps"))
    scheme, system, mode = EXACT[name], Oscillator(w, xi), Mode()
    state = State(0.0, np.array([I4.start["u0"]]), np.array([I4.start["v0"]]))
    memory = scheme.start(system, state, mode, dt)
    for _ in range(int(steps)):
        result = scheme.step(system, state, dt, mode, memory)
        assert result.report.converged
        state, memory = result.state, result.memory
    found = [state.q[0], state.v[0], memory.aux[0]]
    assert found == pytest.approx(I4[f"[u, v, a] after 50 steps | {name}"].value, abs=1e-10)


def spring_and_dashpot(w: float, xi: float, mass: float) -> mbd.Model:
    """The same oscillator as a body."""
    model = mbd.Model("oscillator", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("mass", mass)
    loss = mbd.Viscous(2 * xi * w * mass)
    model.connect(mbd.Prismatic("guide", model.ground.origin, body.origin, loss=loss, stiffness=mass * w * w))
    return model


@pytest.mark.parametrize("backend", ["auto", "python"])
@pytest.mark.parametrize("name", EXACT)
def test_a_body_on_a_spring_takes_the_same_fifty_steps(name: str, backend: str) -> None:
    w, xi, dt, steps = (I4.definition[each] for each in ("w", "xi", "dt", "steps"))
    model = spring_and_dashpot(w, xi, mass=3.7)
    start = mbd.assemble(model, position={"guide.displacement": I4.start["u0"]}, backend=backend)
    run = mbd.simulate(model, start, EXACT[name], dt=dt, until=steps * dt, backend=backend)
    u, v, a = I4[f"[u, v, a] after 50 steps | {name}"].value
    assert [run["guide.displacement"][-1], run["guide.rate"][-1]] == pytest.approx([u, v], abs=1e-10)
    true = -2 * xi * w * v - w * w * u  # users see the acceleration of the balance, not the scheme's average
    assert run["guide.acceleration"][-1] == pytest.approx(true, abs=1e-9)
    assert (abs(true - a) < 1e-9) == (name == "trapezoidal")
    assert u == pytest.approx(I4["exact u(t_end)"].value, abs=0.03)


@pytest.mark.parametrize("scheme", [mbd.HHT(0.2, start="consistent"), mbd.GeneralizedAlpha(0.3)], ids=name_of)
def test_other_discrete_solutions_are_powers_of_the_written_out_matrix(scheme: NewmarkFamily) -> None:
    """Another oscillator and step; with the jerk start a₀ = v̇₀ + (α_m − α_f) dt j₀."""
    w, xi, dt, steps = 3.1, 0.11, 0.27, 33
    model, k = spring_and_dashpot(w, xi, mass=0.9), scheme.coefficients
    u, v = 0.4, -1.3
    a = -2 * xi * w * v - w * w * u
    jerk = -2 * xi * w * a - w * w * v
    shift = (k.alpha_m - k.alpha_f) * dt if scheme.starting == "jerk" else 0.0
    matrix = written_out(k, w * dt, xi)
    expected = np.linalg.matrix_power(matrix, steps) @ [u, v * dt, (a + shift * jerk) * dt * dt]
    start = mbd.assemble(model, position={"guide.displacement": u}, velocity={"guide.rate": v})
    run = mbd.simulate(model, start, scheme, dt=dt, until=steps * dt)
    tolerance = 1e-10 if scheme.starting == "consistent" else 1e-3  # the jerk is a difference over dt/16
    found = [run["guide.displacement"][-1], run["guide.rate"][-1] * dt]
    assert found == pytest.approx(expected[:2], abs=tolerance)
