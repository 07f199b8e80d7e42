"""How many of everything, what does not change while the kernel runs, and what the scheme is able to do."""

from __future__ import annotations

from mbd.kernel.records.declare import Reals, Record, formula, reals


class Sizes(Record):
    """How many of everything, and where inputs begin in the block, which `mbd.compile.layout` explains."""

    n_q: int
    n_v: int
    n: int  # n_v + n_z rates
    n_rows: int
    n_anchors: int
    n_contacts: int
    n_guards: int  # of the user
    n_frictions: int
    n_machines: int  # discrete states with transitions
    n_impulses: int  # of the user, as contacts close
    n_cones: int  # groups of frictions that slide together, those of contacts in space and of ball joints
    capacity: int  # stored rows
    event_capacity: int

    o_q: int = formula(lambda s: 3)  # where inputs begin in the block, behind t and two coefficients of the scheme
    o_x: int = formula(lambda s: 3 + s.n_q)
    o_v: int = formula(lambda s: s.o_x + s.n_v)
    o_a: int = formula(lambda s: s.o_v + s.n)
    o_lam: int = formula(lambda s: s.o_a + s.n)
    o_anchor: int = formula(lambda s: s.o_lam + s.n_rows)
    o_switch: int = formula(lambda s: s.o_anchor + s.n_anchors)
    o_slip: int = formula(lambda s: s.o_switch + s.n_contacts)
    n_block: int = formula(lambda s: s.o_slip + s.n_frictions + s.n_v)  # numbers of it, the predicted shift among them
    width: int = formula(lambda s: 1 + s.n_q + 2 * s.n + s.n_rows + s.n_contacts + s.n_frictions)  # of a stored row
    event_width: int = formula(lambda s: 5 + s.n_rows)  # of a line of the log
    n_kkt: int = formula(lambda s: s.n + s.n_rows)  # unknowns of balance and rows together
    n_unknowns: int = formula(lambda s: s.n_rows * (s.n_contacts + s.n_frictions > 0))  # of a problem over cones
    n_discs: int = formula(
        lambda s: min(s.n_cones, 1) * (s.n_contacts + s.n_frictions)
    )  # see `mbd.kernel.contact.discs`
    n_disc_unknowns: int = formula(lambda s: min(s.n_cones, 1) * (s.n_rows + 1))
    n_tangent: int = formula(
        lambda s: s.n_kkt * s.n_kkt + 3 * (s.n + 2 * s.n_rows + s.n_rows * s.n) + 2 * s.n_kkt + 2
    )  # numbers that the programs of a mode write at most
    acc_f: int = formula(
        lambda s: s.n * s.n
    )  # where f begins in acc, behind M (n, n); R (n, n_rows), B (n_rows, n), h and what is below follow
    acc_R: int = formula(lambda s: s.n * s.n + s.n)  # where R = ∂r/∂λ begins
    acc_B: int = formula(lambda s: s.n * s.n + s.n + s.n * s.n_rows)  # where B = ∂ḣ/∂v begins
    acc_h: int = formula(lambda s: s.n * s.n + s.n + 2 * s.n * s.n_rows)  # where h begins
    acc_rate: int = formula(lambda s: s.n * s.n + s.n + 2 * s.n * s.n_rows + s.n_rows)  # where ḣ begins
    acc_bias: int = formula(
        lambda s: s.n * s.n + s.n + 2 * s.n * s.n_rows + 2 * s.n_rows
    )  # where γ begins, the part of ḧ without accelerations
    acc_captured: int = formula(
        lambda s: s.n * s.n + s.n + 2 * s.n * s.n_rows + 3 * s.n_rows
    )  # where the anchors begin that contacts would hold
    acc_limit: int = formula(
        lambda s: s.n * s.n + s.n + 2 * s.n * s.n_rows + 3 * s.n_rows + s.n_anchors + 1
    )  # where the largest frictions begin, behind the kinetic energy
    acc_impulse: int = formula(lambda s: s.acc_limit + s.n_frictions)  # where w P of the user's impulses begin
    at_gap_rate: int = formula(lambda s: s.n_contacts)  # where gap rates begin among guard values, behind the gaps
    at_force: int = formula(lambda s: 2 * s.n_contacts)  # forces of penalty contacts
    at_condition: int = formula(lambda s: 3 * s.n_contacts)  # measures by which contacts are watched
    at_user: int = formula(lambda s: 4 * s.n_contacts)  # guards of the user
    at_user_rate: int = formula(lambda s: s.at_user + s.n_guards)
    at_slip: int = formula(lambda s: s.at_user + 2 * s.n_guards)  # sliding velocities of frictions
    at_slip_rate: int = formula(lambda s: s.at_slip + s.n_frictions)
    at_limit: int = formula(lambda s: s.at_slip + 2 * s.n_frictions)  # largest frictions
    at_allowed: int = formula(lambda s: s.at_limit + s.n_frictions)  # conditions of transitions, of machines
    n_watched: int = formula(lambda s: s.at_allowed + min(s.n_machines, 1) * s.n_guards)  # guard values in all
    n_marks: int = formula(lambda s: 2 * s.n_contacts + 2 * s.n_guards)  # of what may happen at an instant
    flag_user: int = formula(lambda s: s.n_contacts)  # where guards of the user begin among flags, behind contacts
    flag_friction: int = formula(lambda s: s.n_contacts + s.n_guards)  # frictions


class Settings(Sizes):
    """What does not change while the kernel runs."""

    vector: int  # 1: q ⊕ x is q + x
    treelike: int  # 1: without rows accelerations come from `FREE_RATES`
    stabilized: int  # 1: velocity level with position correction, 0: index 3
    jerk: int  # 1: a₀ starts from the jerk, 0: a₀ = v̇₀
    exact: int  # 1: iterate until round-off
    linear: int  # 1: event instants by one linear interpolation
    stride: int  # steps from one stored row to the next
    strategy: int  # 0 located events, 1 non-smooth steps
    auto: int  # 1: non-smooth steps follow where located impacts crowd
    impact_law: int  # 0 Newton, 1 Poisson, 2 sequential
    loads_act: int  # 1 where forces follow multipliers: smooth friction of contacts by rows, laws that read them
    loaded: int  # forces follow multipliers other than linearly: 1 pins and laws, 2 friction not at all where one pulls
    error_order: int  # power of the step with which the estimated error per second falls
    driven: int  # 1: drives prescribe motion, and multipliers are part of the error or decide about contacts
    n_substeps: int  # substeps of a step at whose ends guards are evaluated; 1: at those of the step only
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    tolerance: float
    rest_speed: float
    dt: float  # of all steps, or where they follow the error a time that is short beside the motion
    allowed: float  # local error in positions [m, rad] per second, 0: steps are all dt
    longest: float  # step
    n_clusters: int  # of coordinates that nothing connects to others: see `mbd.equations.clusters`

    adaptive: int = formula(lambda s: int(s.allowed > 0.0))  # 1: steps follow the estimated error
    max_switches: int = formula(lambda s: 20 + 4 * (s.n_contacts + s.n_guards + s.n_frictions))  # at one instant


class SchemeAbilities(Settings):
    """The number of the scheme, and what it is able to do: see `mbd.kernel.schemes.contract`."""

    scheme: int
    explicit: int
    estimates: int
    second_look: int
    singular_size: int
    stretches: int
    n_nodes: int
    look_twice: float
    error_constant: float
    stability: float
    most_growth: float
    middle: float
    far_look: float
    longest_over: float
    nodes: Reals = reals(lambda s: s.n_nodes)  # parts of a step at which it has stages, its end not counted
