"""How many of everything, what does not change while the kernel runs, and what the scheme is able to do."""

from __future__ import annotations

from mbd.kernel.records.declare import Reals, Record, reals

__all__ = ["SchemeAbilities", "Settings", "Sizes"]


class Sizes(Record):
    """How many of everything, and where inputs begin in the block."""

    n_q: int
    n_v: int
    n: int  # n_v + n_z rates
    n_rows: int
    n_anchors: int
    n_contacts: int
    n_guards: int  # of the user
    n_frictions: int
    o_q: int  # offsets into the block
    o_x: int
    o_v: int
    o_a: int
    o_lam: int
    o_anchor: int
    o_switch: int
    o_slip: int
    n_watched: int  # guard values in all
    width: int  # of a stored row
    capacity: int  # stored rows
    event_width: int
    event_capacity: int

    @property
    def n_kkt(self) -> int:
        """Unknowns of balance and rows together."""
        return self.n + self.n_rows

    @property
    def n_lcp(self) -> int:
        """Unknowns of the linear complementarity problem."""
        return self.n_contacts + 3 * self.n_frictions

    @property
    def n_tangent(self) -> int:
        """Numbers that the programs of a mode write at most."""
        beside = self.n + 2 * self.n_rows + self.n_rows * self.n
        return self.n_kkt * self.n_kkt + 3 * beside + 2 * self.n_kkt + 2

    @property
    def acc_f(self) -> int:
        """Where f begins in acc, behind M (n, n); R (n, n_rows), B (n_rows, n), h and what is below follow."""
        return self.n * self.n

    @property
    def acc_R(self) -> int:
        """Where R = ∂r/∂λ begins."""
        return self.n * self.n + self.n

    @property
    def acc_B(self) -> int:
        """Where B = ∂ḣ/∂v begins."""
        return self.n * self.n + self.n + self.n * self.n_rows

    @property
    def acc_h(self) -> int:
        """Where h begins."""
        return self.n * self.n + self.n + 2 * self.n * self.n_rows

    @property
    def acc_rate(self) -> int:
        """Where ḣ begins."""
        return self.n * self.n + self.n + 2 * self.n * self.n_rows + self.n_rows

    @property
    def acc_bias(self) -> int:
        """Where γ begins, the part of ḧ without accelerations."""
        return self.n * self.n + self.n + 2 * self.n * self.n_rows + 2 * self.n_rows

    @property
    def acc_captured(self) -> int:
        """Where the anchors begin that contacts would hold."""
        return self.n * self.n + self.n + 2 * self.n * self.n_rows + 3 * self.n_rows

    @property
    def acc_limit(self) -> int:
        """Where the largest frictions begin, behind the kinetic energy."""
        return self.n * self.n + self.n + 2 * self.n * self.n_rows + 3 * self.n_rows + self.n_anchors + 1


class Settings(Sizes):
    """What does not change while the kernel runs."""

    vector: int  # 1: q ⊕ x is q + x
    stabilized: int  # 1: velocity level with position correction, 0: index 3
    jerk: int  # 1: a₀ starts from the jerk, 0: a₀ = v̇₀
    exact: int  # 1: iterate until round-off
    max_iterations: int
    max_switches: int
    linear: int  # 1: event instants by one linear interpolation
    stride: int  # steps from one stored row to the next
    chunk: int  # steps before control returns
    strategy: int  # 0 located events, 1 non-smooth steps
    auto: int  # 1: non-smooth steps follow where located impacts crowd
    impact_law: int  # 0 Newton, 1 Poisson, 2 sequential
    n_judged: int  # unilateral contacts that open where they pull, and frictions
    loaded: int  # a friction follows multipliers other than linearly: 1 as that of a pin, 2 not at all where one pulls
    adaptive: int  # 1: steps follow the estimated error, 0: they are all dt
    error_order: int  # power of the step with which the estimated error per second falls
    looks: int  # substeps of a step at whose ends guards are evaluated; 1: at those of the step only
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    tolerance: float
    rest_speed: float
    until: float
    end: float
    dt: float  # of all steps, or where they follow the error a time that is short beside the motion
    allowed: float  # local error in positions [m, rad] per second
    longest: float  # step


class SchemeAbilities(Settings):
    """The number of the scheme, and what it is able to do: see `mbd.kernel.schemes.contract`."""

    scheme: int
    explicit: int
    estimates: int
    singular_size: int
    stretches: int
    n_nodes: int
    look_twice: float
    error_constant: float
    most_growth: float
    middle: float
    far_look: float
    longest_over: float
    nodes: Reals = reals(lambda s: s.n_nodes)  # parts of a step at which it has stages, its end not counted
