"""Numerical criteria of integrators, measured by stepping them, against exact values and closed forms."""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

import mbd
from mbd.analysis.amplification import amplification_matrix
from mbd.analysis.numerical import _closed_form, criteria, plot, spectrum
from mbd.integrators import Integrator, StepReport, StepResult
from mbd.integrators.averaged import Coefficients
from mbd.integrators.base import consistent_rates
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import name_of
from tests.problems import case

I1, I2, I3, I4 = (
    case(name)
    for name in ("i1-spectral-properties", "i2-asymptotic-coefficients", "i3-hht-beta", "i4-discrete-exactness")
)


class WBZ(NewmarkFamily):
    """The scheme of Wood, Bossak & Zienkiewicz (1980): α_f = 0. A member of the family that a user adds."""

    rho_inf: float

    def __init__(self, rho_inf: float) -> None:
        super().__init__("ggl", "consistent", 1e-11, rho_inf=rho_inf)

    @property
    def coefficients(self) -> Coefficients:
        alpha_m = (self.rho_inf - 1.0) / (self.rho_inf + 1.0)
        gamma = 0.5 - alpha_m
        return Coefficients(alpha_m, 0.0, 0.25 * (gamma + 0.5) ** 2, gamma)


SCHEMES = {
    "Newmark trapezoidal (beta 1/4, gamma 1/2)": mbd.Newmark(),
    "Newmark linear acceleration (1/6, 1/2)": mbd.Newmark(beta=1 / 6),
    "Newmark damped (0.3025, 0.6)": mbd.Newmark(beta=0.3025, gamma=0.6),
    "HHT alpha = 0.05 (chapter text)": mbd.HHT(alpha=0.05),
    "HHT alpha = 1/3": mbd.HHT(alpha=1 / 3),
    "generalized-alpha rho_inf 0.8": mbd.GeneralizedAlpha(0.8),
    "generalized-alpha rho_inf 0": mbd.GeneralizedAlpha(0.0),
    "WBZ rho_inf 0.7": WBZ(0.7),
}
ALL = SCHEMES | {
    "HHT alpha = 0.1": mbd.HHT(alpha=0.1), "HHT alpha = 0.3": mbd.HHT(alpha=0.3),
    "generalized-alpha rho_inf 0.5": mbd.GeneralizedAlpha(0.5),
}  # fmt: skip
DAMPED = [(name, xi) for name in ALL for xi in (0.0, 0.05) if any(f"{name}, xi={xi:g}" in q for q in I1.quantities)]
MEASURED = [*list(SCHEMES)[:4], "generalized-alpha rho_inf 0"]
FEW = (0.1, 1.0)


def amplification_in_closed_form(k: Coefficients, turn: float, damping: float = 0.0) -> np.ndarray:
    """(3, 3) what a step does to (u, dt u̇, dt² a), with ω dt = `turn` and ξ = `damping`.

    ``u₁ = u₀ + dt u̇₀ + dt² ((½−β) a₀ + β a₁)``, ``u̇₁ = u̇₀ + dt ((1−γ) a₀ + γ a₁)`` and
    ``(1−α_m) a₁ + α_m a₀ + (1−α_f) (2ξω u̇ + ω² u)₁ + α_f (2ξω u̇ + ω² u)₀ = 0`` (Chung & Hulbert 1993, eqs. 1-5).
    """
    c, s, f, m = 2.0 * damping * turn, turn * turn, k.alpha_f, k.alpha_m
    left = np.array([[1.0, 0.0, -k.beta], [0.0, 1.0, -k.gamma], [(1 - f) * s, (1 - f) * c, 1 - m]])
    right = np.array([[1.0, 1.0, 0.5 - k.beta], [0.0, 1.0, 1.0 - k.gamma], [-f * s, -f * c, -m]])
    return np.asarray(np.linalg.solve(left, right))


@cache
def measured(name):
    return criteria(SCHEMES[name], turns=FEW)


# the published values ---------------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", ALL)
def test_a_scheme_has_the_four_numbers_of_its_family(name):
    c = ALL[name].coefficients
    expected = I1[f"parameters (alpha_m, alpha_f, beta, gamma) | {name}"].value
    assert [c.alpha_m, c.alpha_f, c.beta, c.gamma] == pytest.approx(expected, abs=1e-15)
    assert c.rho_inf == pytest.approx(I1[f"rho_infinity | {name}"].value, abs=1e-14)


@pytest.mark.parametrize(("name", "xi"), DAMPED)
def test_spectra_of_the_exact_matrix_and_of_steps_are_the_published_ones(name, xi):
    turns, k, of = (0.1, 0.5, 1.0, 2.0), ALL[name].coefficients, f"{name}, xi={xi:g}"
    radii = I1[f"spectral radius at Omega = w dt = 0.1, 0.5, 1, 2, 10, 1000 | {of}"].value
    damping = I1[f"algorithmic damping ratio at Omega = [0.1, 0.5, 1.0, 2.0] | {of}"].value
    longer = I1[f"relative period elongation T_bar/T - 1 at Omega = [0.1, 0.5, 1.0, 2.0] | {of}"].value
    exact = [max(abs(np.linalg.eigvals(amplification_in_closed_form(k, turn, xi)))) for turn in (*turns, 10.0, 1000.0)]
    assert exact == pytest.approx(radii, abs=1e-10)
    found = [spectrum(ALL[name], turn, xi) for turn in turns]
    assert [each.radius for each in found] == pytest.approx(radii[:4], abs=1e-8)
    angles = np.abs(np.angle([each.principal for each in found]))
    assert -np.log(np.abs([each.principal for each in found])) / angles == pytest.approx(damping, abs=1e-10)
    assert turns / angles - 1.0 == pytest.approx(longer, abs=1e-10)
    if xi == 0.0:  # else what is told is that of the scheme, without the oscillator's
        assert [each.damping for each in found] == pytest.approx(damping, abs=1e-10)
        assert [each.elongation for each in found] == pytest.approx(longer, abs=1e-10)


def extrapolated(value):
    """The limit at zero of a function of Ω², from Ω = 0.08, 0.04, 0.02."""
    a, b, c = (value(turn) for turn in (0.08, 0.04, 0.02))
    ab, bc = (4 * b - a) / 3, (4 * c - b) / 3
    return (16 * bc - ab) / 15


@pytest.mark.parametrize("name", SCHEMES)
def test_closed_forms_have_the_published_limits(name):
    found, power = _closed_form(SCHEMES[name]), 1 if "damped" in name else 3
    longer = I2[f"lim of (T_bar/T - 1)/Omega^2 | {name}"]
    damping = I2[f"lim of damping ratio/Omega{f'^{power}' if power > 1 else ''} | {name}"]
    assert found.rho_inf == pytest.approx(I1[f"rho_infinity | {name}"].value, abs=1e-12)
    assert (found.elongation_order, found.damping_order) == (2, power if damping.value else 0)
    assert found.elongation_coefficient == pytest.approx(longer.value, abs=1e-9)
    assert found.damping_coefficient == pytest.approx(damping.value, abs=1e-9)


@pytest.mark.parametrize(
    "scheme", [mbd.HHT(0.17), mbd.GeneralizedAlpha(0.33), mbd.GeneralizedAlpha(0.93), WBZ(0.2)], ids=name_of
)
def test_any_second_order_member_has_the_coefficients_of_the_general_formulas(scheme):
    """(12β − 1 + 12 α_f (α_m − α_f))/24 and ½ (α_f − α_m)(β + α_f (α_m − 1)): other parameters than the published."""
    k = scheme.coefficients
    elongation = (12 * k.beta - 1 + 12 * k.alpha_f * (k.alpha_m - k.alpha_f)) / 24
    damping = 0.5 * (k.alpha_f - k.alpha_m) * (k.beta + k.alpha_f * k.alpha_m - k.alpha_f)
    assert extrapolated(lambda turn: spectrum(scheme, turn).elongation / turn**2) == pytest.approx(elongation, abs=1e-6)
    assert extrapolated(lambda turn: spectrum(scheme, turn).damping / turn**3) == pytest.approx(damping, abs=2e-6)


@pytest.mark.parametrize("name", MEASURED)
def test_what_is_measured_by_steps_is_what_closed_forms_say(name):
    """Also at infinity, where roots may be multiple."""
    found, exact = measured(name), measured(name).exact
    assert found.order == pytest.approx(found.promised, abs=0.15) and exact.order == found.promised
    assert exact.rho_inf == pytest.approx(found.rho_inf, abs=2e-5)
    assert (exact.damping_order, exact.elongation_order) == (found.damping_order, found.elongation_order)
    assert exact.damping_coefficient == pytest.approx(found.damping_coefficient, abs=2e-6)
    assert exact.elongation_coefficient == pytest.approx(found.elongation_coefficient, abs=1e-6)
    assert exact.stability_limit is None or exact.stability_limit == pytest.approx(found.stability_limit, rel=1e-6)


def test_linear_acceleration_is_stable_up_to_its_critical_step():
    limit = I2["linear acceleration: critical Omega"].value
    assert measured("Newmark linear acceleration (1/6, 1/2)").stability_limit == pytest.approx(limit, rel=1e-8)
    assert measured("HHT alpha = 0.05 (chapter text)").stability_limit == np.inf


class Unsquared(mbd.HHT):
    """HHT with β = (1+α)/4."""

    @property
    def coefficients(self) -> Coefficients:
        return Coefficients(0.0, self.alpha, 0.25 * (1.0 + self.alpha), 0.5 + self.alpha)


def test_hht_squares_its_beta_for_without_the_square_it_is_unstable():
    unsquared, squared = (quantity.value for quantity in I3.quantities.values())
    assert spectrum(Unsquared(0.05), 1e4).radius == pytest.approx(unsquared, abs=1e-10)
    assert spectrum(mbd.HHT(0.05), 1e4).radius == pytest.approx(squared, abs=1e-10)
    found = criteria(Unsquared(0.05), turns=FEW)
    assert 1.0 < found.stability_limit < 100.0 and found.rho_inf > 1.4
    for alpha in (0.02, 0.12, 0.3):
        assert mbd.HHT(alpha).coefficients.beta == 0.25 * (1 + alpha) ** 2
        assert mbd.HHT(alpha).coefficients.rho_inf == pytest.approx((1 - alpha) / (1 + alpha), abs=1e-14)
        assert spectrum(mbd.HHT(alpha), 1e4).radius < 1.0
        assert spectrum(Unsquared(alpha), 1e4).radius > 1.05


@pytest.mark.parametrize("alpha", [-1e-9, 1 / 3 + 1e-9, 0.5, math.nan])
def test_hht_refuses_an_alpha_for_which_it_is_unstable_or_of_first_order(alpha):
    with pytest.raises(mbd.CapabilityError, match="alpha between 0 and 1/3"):
        mbd.HHT(alpha)


# the discrete solution --------------------------------------------------------------------------------------------
DISCRETE = {
    "trapezoidal": mbd.Newmark(start="consistent"), "HHT 0.05": mbd.HHT(alpha=0.05, start="consistent"),
    "generalized-alpha 0.6": mbd.GeneralizedAlpha(0.6, start="consistent"),
}  # fmt: skip


@pytest.mark.parametrize("name", DISCRETE)
def test_powers_of_the_written_out_matrix_are_the_discrete_solution(name):
    w, xi, dt, steps = (I4.definition[each] for each in ("w", "xi", "dt", "steps"))
    matrix = amplification_in_closed_form(DISCRETE[name].coefficients, w * dt, xi)
    found = np.linalg.matrix_power(matrix, int(steps)) @ [1.0, 0.0, -((w * dt) ** 2)]
    assert found / [1.0, dt, dt * dt] == pytest.approx(I4[f"[u, v, a] after 50 steps | {name}"].value, abs=1e-10)


def spring_and_dashpot(w: float, xi: float, mass: float) -> mbd.Model:
    """The same oscillator as a body."""
    model = mbd.Model("oscillator", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("mass", mass)
    loss = mbd.Viscous(2 * xi * w * mass)
    model.connect(mbd.Prismatic("guide", model.ground.origin, body.origin, loss=loss, stiffness=mass * w * w))
    return model


@pytest.mark.parametrize("backend", ["auto", "python"])
@pytest.mark.parametrize("name", DISCRETE)
def test_a_body_on_a_spring_takes_the_same_fifty_steps(name, backend):
    w, xi, dt, steps = (I4.definition[each] for each in ("w", "xi", "dt", "steps"))
    model = spring_and_dashpot(w, xi, mass=3.7)
    start = mbd.assemble(model, position={"guide.displacement": I4.start["u0"]}, backend=backend)
    run = mbd.simulate(model, start, DISCRETE[name], dt=dt, until=steps * dt, backend=backend)
    u, v, a = I4[f"[u, v, a] after 50 steps | {name}"].value
    assert [run["guide.displacement"][-1], run["guide.rate"][-1]] == pytest.approx([u, v], abs=1e-10)
    true = -2 * xi * w * v - w * w * u  # users see the acceleration of the balance, not the scheme's average
    assert run["guide.acceleration"][-1] == pytest.approx(true, abs=1e-9)
    assert (abs(true - a) < 1e-9) == (name == "trapezoidal")
    assert u == pytest.approx(I4["exact u(t_end)"].value, abs=0.03)


@pytest.mark.parametrize("scheme", [mbd.HHT(0.2, start="consistent"), mbd.GeneralizedAlpha(0.3)], ids=name_of)
def test_other_discrete_solutions_are_powers_of_the_written_out_matrix(scheme):
    """Another oscillator and step; with the jerk start a₀ = v̇₀ + (α_m − α_f) dt j₀."""
    w, xi, dt, steps = 3.1, 0.11, 0.27, 33
    model, k = spring_and_dashpot(w, xi, mass=0.9), scheme.coefficients
    u, v = 0.4, -1.3
    a = -2 * xi * w * v - w * w * u
    jerk = -2 * xi * w * a - w * w * v
    shift = (k.alpha_m - k.alpha_f) * dt if scheme.starting == "jerk" else 0.0
    matrix = amplification_in_closed_form(k, w * dt, xi)
    expected = np.linalg.matrix_power(matrix, steps) @ [u, v * dt, (a + shift * jerk) * dt * dt]
    start = mbd.assemble(model, position={"guide.displacement": u}, velocity={"guide.rate": v})
    run = mbd.simulate(model, start, scheme, dt=dt, until=steps * dt)
    tolerance = 1e-10 if scheme.starting == "consistent" else 1e-3  # the jerk is a difference over dt/16
    found = [run["guide.displacement"][-1], run["guide.rate"][-1] * dt]
    assert found == pytest.approx(expected[:2], abs=tolerance)


# properties -------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("scheme", [
    mbd.Newmark(0.28, 0.53), *map(mbd.HHT, (0.0, 0.02, 0.21, 0.28)),
    *map(mbd.GeneralizedAlpha, (0.0, 0.15, 0.35, 0.97)),
], ids=name_of)  # fmt: skip
@pytest.mark.parametrize("turn", [0.03, 0.7, 5.0, 80.0])
@pytest.mark.parametrize("xi", [0.0, 0.3])
def test_the_roots_of_a_step_are_those_of_the_written_out_matrix(scheme, turn, xi):
    found = np.poly(amplification_matrix(scheme, turn, xi))
    wanted = np.poly(amplification_in_closed_form(scheme.coefficients, turn, xi))
    length = max(len(found), len(wanted))  # roots at zero may be left out, or be there to round-off
    assert np.pad(found, (0, length - len(found))) == pytest.approx(np.pad(wanted, (0, length - len(wanted))), abs=1e-9)


def test_the_damping_ratio_of_the_oscillator_is_not_counted_as_that_of_the_scheme():
    found = spectrum(mbd.Newmark(), 0.01, 0.3)
    assert abs(found.damping) < 1e-4 and abs(found.elongation) < 1e-4
    assert abs(found.principal - np.exp(0.01 * (-0.3 + 1j * np.sqrt(1 - 0.09)))) < 1e-6


def test_the_start_of_a_scheme_does_not_change_its_matrix():
    one, other = (spectrum(mbd.HHT(0.1, start=start), 0.8) for start in ("jerk", "consistent"))
    assert one.radius == pytest.approx(other.radius, abs=1e-12)


def test_the_averaged_form_steps_a_stiff_oscillator_whose_forces_are_round_off():
    assert spectrum(mbd.HHT(0.05, form="averaged"), 1e5).radius == pytest.approx(0.95 / 1.05, abs=1e-6)


def test_the_averaged_form_has_the_spectrum_of_the_other_one():
    for turn in 0.1, 1.0, 10.0:
        one, other = (spectrum(mbd.HHT(0.1, form=form), turn) for form in ("averaged", "endpoint"))
        assert one.radius == pytest.approx(other.radius, abs=1e-9)


# schemes of users -------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class RungeKutta(Integrator):
    """Explicit Runge-Kutta by a table of Butcher with one subdiagonal; nothing is remembered."""

    steps: tuple[float, ...]
    weights: tuple[float, ...]

    def order(self, system=None):
        return len(self.weights)

    def start(self, system, state, mode, dt):
        return None

    def step(self, system, state, dt, mode, memory):
        def slope(y):
            return np.concatenate([y[1:], consistent_rates(system, state.time, y[:1], y[1:], mode)[0]])

        y, k, total = np.concatenate([state.q, state.v]), np.zeros(2), np.zeros(2)
        for share, weight in zip((0.0, *self.steps), self.weights, strict=True):
            k = slope(y + dt * share * k)
            total = total + weight * k
        y = y + dt * total
        return StepResult(replace(state, time=state.time + dt, q=y[:1], v=y[1:]), memory, StepReport(True))


HEUN = RungeKutta((1.0,), (0.5, 0.5))
KUTTA = RungeKutta((0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6))


def test_kuttas_scheme_is_of_order_four_and_stable_up_to_the_root_of_eight():
    found = criteria(KUTTA, turns=FEW)
    assert found.order == pytest.approx(4.0, abs=0.15)
    assert found.stability_limit == pytest.approx(np.sqrt(8.0), rel=1e-6)
    assert found.rho_inf == np.inf and found.exact is None
    z = 1j * 0.7
    polynomial = 1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24
    assert abs(spectrum(KUTTA, 0.7).principal - polynomial) < 1e-12


def test_heuns_scheme_grows_at_every_step_without_damping_and_not_with_it():
    s = -0.1 + 1j * np.sqrt(0.99)
    first = brentq(lambda turn: abs(1 + turn * s + (turn * s) ** 2 / 2) - 1.0, 0.5, 2.0)
    assert criteria(HEUN, turns=FEW).stability_limit < 0.02
    assert criteria(HEUN, damping=0.1, turns=FEW).stability_limit == pytest.approx(first, rel=1e-6)


@dataclass(frozen=True)
class Backwards(Integrator):
    """BDF2 on (q, v) of a linear system; it remembers the state before, as a mapping with a counter and a word."""

    def order(self, system=None):
        return 2

    def start(self, system, state, mode, dt):
        return {"before": None, "count": 0, "name": "BDF2"}

    def step(self, system, state, dt, mode, memory):
        w = system.frequency
        matrix = np.array([[0.0, 1.0], [-(w**2), -2 * system.damping * w]])
        y = np.concatenate([state.q, state.v])
        if memory["before"] is None:  # one step of the trapezoidal rule
            after = np.linalg.solve(np.eye(2) - dt / 2 * matrix, (np.eye(2) + dt / 2 * matrix) @ y)
        else:
            after = np.linalg.solve(1.5 * np.eye(2) - dt * matrix, 2.0 * y - 0.5 * np.concatenate(memory["before"]))
        kept = {"before": (state.q, state.v), "count": memory["count"] + 1, "name": "BDF2"}
        return StepResult(replace(state, time=state.time + dt, q=after[:1], v=after[1:]), kept, StepReport(True))


@pytest.mark.parametrize("turn", [0.2, 1.0, 30.0])
def test_a_multistep_scheme_has_the_roots_of_its_characteristic_polynomial(turn):
    """(3/2 − i ω dt) z² − 2 z + ½ = 0 and its conjugate."""
    wanted = np.roots([1.5 - 1j * turn, -2.0, 0.5])
    found = np.linalg.eigvals(amplification_matrix(Backwards(), turn))
    assert len(found) == 4
    for z in (*wanted, *wanted.conj()):
        assert min(abs(found - z)) < 1e-10


def test_a_multistep_scheme_has_its_order_and_damps_infinite_stiffness_away():
    found = criteria(Backwards(), turns=FEW)
    assert found.order == pytest.approx(2.0, abs=0.15)
    assert found.stability_limit == np.inf
    assert found.rho_inf < 0.01


# what is refused --------------------------------------------------------------------------------------------------
class Limited(RungeKutta):
    """A scheme that is not linear: no step moves farther than 1 mm."""

    def step(self, system, state, dt, mode, memory):
        result = super().step(system, state, dt, mode, memory)
        q = state.q + np.clip(result.state.q - state.q, -1e-3, 1e-3)
        return replace(result, state=replace(result.state, q=q))


class Failing(RungeKutta):
    def step(self, system, state, dt, mode, memory):
        return StepResult(state, memory, StepReport(False, message="no step today"))


def test_a_scheme_that_is_not_linear_has_no_matrix():
    with pytest.raises(mbd.CapabilityError, match="is not linear in position, velocity and memory"):
        amplification_matrix(Limited((1.0,), (0.5, 0.5)), 0.5)


def test_an_error_estimate_in_the_memory_need_not_be_linear():
    found = criteria(mbd.RungeKutta853(), turns=FEW)
    assert found.order == pytest.approx(8.0, abs=0.2) and found.rho_inf == np.inf
    assert 5.5 < found.stability_limit < 6.5
    z = 0.7j
    series = sum(z**k / math.factorial(k) for k in range(9))  # the terms to order 8 are those of the exponential
    assert abs(spectrum(mbd.RungeKutta853(), 0.7).principal - series) < 1e-6


def test_a_scheme_that_does_not_step_says_why():
    with pytest.raises(mbd.CapabilityError, match="no step today"):
        criteria(Failing((1.0,), (0.5, 0.5)), turns=FEW)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("HHT",), "an integrator is expected"),
        ((mbd.HHT(), -0.1), "0 ≤ ξ < 1"),
        ((mbd.HHT(), 0.0, [0.1, -1.0]), "numbers above 0"),
        ((mbd.HHT(), 0.0, [np.nan]), "numbers above 0"),
        ((mbd.HHT(), 0.0, []), "numbers above 0"),
        ((mbd.HHT(), 0.0, [1e9]), "up to 1e\\+06"),
    ],
)
def test_bad_arguments_are_named(arguments, says):
    with pytest.raises(mbd.ModelError, match=says):
        criteria(*arguments)


# table and plot ---------------------------------------------------------------------------------------------------
def test_the_table_shows_the_closed_form_beside_the_measurement():
    table = str(measured("Newmark linear acceleration (1/6, 1/2)"))
    assert "closed form" in table and table.count("3.4641") == 2 and table.count("0.04167 (ω dt)²") == 2
    assert "closed form" not in str(criteria(KUTTA, turns=FEW))


def test_the_plot_draws_every_integrator_in_every_panel(tmp_path):
    chosen = [measured(name) for name in MEASURED[:4]]
    figure = plot(*chosen, path=tmp_path / "spectra.png")
    assert (tmp_path / "spectra.png").stat().st_size > 10000
    radius, damping, elongation = figure.axes
    labels = [line.get_label() for line in radius.get_lines()]
    assert [label for label in labels if not label.startswith("_")] == [
        "Newmark(beta=0.25, gamma=0.5)", "Newmark(beta=0.1667, gamma=0.5)", "Newmark(beta=0.3025, gamma=0.6)",
        "HHT(alpha=0.05)",
    ]  # fmt: skip
    assert {axes.get_xscale() for axes in figure.axes} == {"log"}
    assert np.nanmax(elongation.get_lines()[0].get_ydata()) == pytest.approx(chosen[0].elongation[1])
    assert np.isnan(damping.get_lines()[0].get_ydata()).all()  # the trapezoidal rule does not damp
    assert chosen[0].plot(*chosen[1:], path=tmp_path / "again.png") is not None
