"""The physics of every scene in numbers, its output times, and how an error is measured.

All scenes but S7, whose numbers stand in `space`, are planar. Angles θ are counted from straight down and positive
towards +x, y is up, unless a scene says otherwise; a rod's direction is then (sin θ, −cos θ). SI units, radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from mbd.arrays import Matrix, Vector

G = 9.81
REFERENCES = Path(__file__).parent / "references.npz"


@dataclass(frozen=True)
class Chain:
    """n equal uniform rods in a row, released at rest; a viscous torque −c × relative rate in each joint."""

    angles: tuple[float, ...]
    length: float
    mass: float
    damping: float = 0.0

    @property
    def n(self) -> int:
        return len(self.angles)


@dataclass(frozen=True)
class FourBars:
    """N four-bars in a row (IFToMM A02): N + 1 upright posts and N couplers, uniform rods.

    The tops of the posts start at `speed`. θ of a post is counted from straight up, positive towards +x. Every half
    turn of the posts passes a pose in which all rods lie on one line.
    """

    n: int
    length: float = 1.0
    mass: float = 1.0
    speed: float = 1.0


@dataclass(frozen=True)
class Andrews:
    """Andrews' squeezing mechanism: parameters of the IVP test set (Mazzia & Magherini 2008), SI units."""

    masses: tuple[float, ...] = (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498)
    inertias: tuple[float, ...] = (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
    A: complex = -0.06934 - 0.00227j
    B: complex = -0.03635 + 0.03273j
    C: complex = 0.014 + 0.072j
    stiffness: float = 4530.0
    rest: float = 0.07785
    torque: float = 0.033
    d: float = 0.028
    da: float = 0.0115
    e: float = 0.02
    ea: float = 0.01421
    rr: float = 0.007
    ra: float = 0.00092
    ss: float = 0.035
    sa: float = 0.01874
    sb: float = 0.01043
    sc: float = 0.018
    sd: float = 0.02
    ta: float = 0.02308
    tb: float = 0.00916
    u: float = 0.04
    ua: float = 0.01228
    ub: float = 0.00449
    zf: float = 0.02
    zt: float = 0.04
    fa: float = 0.01421
    start: tuple[float, ...] = (
        -0.0617138900142764496358948458001, 0.0, 0.455279819163070380255912382449, 0.222668390165885884674473185609,
        0.487364979543842550225598953530, -0.222668390165885884674473185609, 1.23054744454982119249735015568,
    )  # fmt: skip
    """β, Θ, γ, Φ, δ, Ω, ε [rad]."""


@dataclass(frozen=True)
class Ball:
    """A ball dropped on the floor; its bounces end at t = (1 + 2 e/(1 − e)) √(2h/g) = 4.06 s."""

    height: float = 1.0
    restitution: float = 0.8
    mass: float = 1.0
    radius: float = 0.1


@dataclass(frozen=True)
class Wheel:
    """A rimless wheel on a slope: feet that stick, plastic impacts. It starts just after one, at `speed` rad/s."""

    inertia: float
    spokes: int = 8
    length: float = 1.0
    mass: float = 1.0
    slope: float = 0.08
    speed: float = 1.4
    steps: int = 20


@dataclass(frozen=True)
class Leg:
    """Thigh and shank, uniform rods on a fixed hip; the knee stops plastically when straight and opens when pulled."""

    thigh: float = 0.4
    thigh_mass: float = 7.0
    shank: float = 0.4
    shank_mass: float = 4.0
    angles: tuple[float, float] = (0.9, -0.4)


@dataclass(frozen=True)
class Compass:
    """The compass gait: hip mass and two legs with point masses `center` from the hip. Angles from straight up."""

    hip: float = 10.0
    leg: float = 5.0
    length: float = 1.0
    center: float = 0.5
    slope: float = 0.0525
    start: tuple[float, ...] = (0.0, 0.0, 0.4, -2.0)
    """θ of stance and swing leg [rad], and their rates [rad/s]."""


@dataclass(frozen=True)
class Elastic:
    """A pendulum whose arm is a stiff damped spring: hinge, slide along the arm, bob with inertia."""

    length: float = 1.0
    mass: float = 1.0
    inertia: float = 0.01
    stiffness: float = 1e7
    damping: float = 1e3
    angle: float = np.pi / 2


@dataclass(frozen=True)
class Stop:
    """A uniform rod that swings against a spring and damper at its tip, which act while θ < `at`."""

    length: float = 1.0
    mass: float = 1.0
    stiffness: float = 1e7
    damping: float = 100.0
    at: float = -0.2
    angle: float = 1.0


CHAINS = {
    "S1": Chain((1.0, 1.6), 1.0, 1.0),
    "S1d": Chain((1.0, 1.6), 1.0, 1.0, damping=0.1),
    **{f"S2_{n}": Chain((np.pi / 2,) * n, 1.0 / n, 1.0 / n) for n in (2, 8, 32)},
}
FOUR_BARS = {f"S3a_{n}": FourBars(n) for n in (1, 10, 40)}
ANDREWS, BALL, LEG, COMPASS, ELASTIC, STOP = Andrews(), Ball(), Leg(), Compass(), Elastic(), Stop()
WHEEL = {"S4b": Wheel(inertia=0.01), "S4b_point": Wheel(inertia=0.0)}


@cache
def _stored() -> dict[str, Matrix]:
    with np.load(REFERENCES) as file:
        return dict(file)


@dataclass(frozen=True)
class Scene:
    """What is simulated and compared.

    Parameters
    ----------
    name : 'S1', 'S2_8', …; the part before '_' names its family
    title : what it is
    until, every : end and distance of the output times [s]; none where `every` is 0
    shown : the coordinates that are compared
    skipped : distance from an impact within which rates are not compared [s]
    """

    name: str
    title: str
    until: float
    every: float
    shown: str
    skipped: float = 0.0
    times: Vector = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        count = round(self.until / self.every) if self.every else 0
        object.__setattr__(self, "times", np.arange(count + 1) * self.every)

    @property
    def family(self) -> str:
        return self.name.partition("_")[0]

    @property
    def reference(self) -> Matrix:
        """(times, coordinates), or (steps, 1) strike times of the wheel."""
        return _stored()[self.name]

    def error(self, values: Matrix, reference: Matrix | None = None) -> float:
        """The largest absolute difference of any compared coordinate at any output time [rad, m; rates; s]."""
        exact = self.reference if reference is None else reference
        values = np.asarray(values, dtype=float)
        if values.shape != exact.shape or not np.all(np.isfinite(values)):
            return float("inf")
        counted = slice(None)
        if self.skipped:
            strikes = _stored()[f"{self.name}_strikes"]
            counted = np.abs(self.times[:, None] - strikes).min(axis=1) > self.skipped  # type: ignore[assignment]
        return float(np.max(np.abs(values - exact)[counted]))


SCENES = {
    scene.name: scene
    for scene in (
        Scene("S1", "double pendulum, 10 s", 10.0, 0.1, "θ of both rods [rad]"),
        Scene("S1d", "double pendulum with viscous joints, 10 s", 10.0, 0.1, "θ of both rods [rad]"),
        *(Scene(name, f"chain of {chain.n} rods, 0.4 s", 0.4, 0.02, "θ of all rods [rad]")
          for name, chain in CHAINS.items() if name.startswith("S2")),
        *(Scene(name, f"{bars.n} four-bar{'s' * (bars.n > 1)}, 10 s", 10.0, 0.1, "θ of the first post [rad]")
          for name, bars in FOUR_BARS.items()),
        Scene("S3b", "Andrews' squeezing mechanism, 0.03 s", 0.03, 0.001, "its 7 angles [rad]"),
        Scene("S4a", "bouncing ball that comes to rest, 5 s", 5.0, 0.05, "height [m]"),
        Scene("S4b", "rimless wheel, 20 steps", 20.0, 0.0, "times of the strikes [s]"),
        Scene("S4b_point", "rimless wheel without inertia, 5 s", 5.0, 0.05, "θ of the stance spoke and its rate"),
        Scene("S4c", "leg with a plastic knee stop, 1.5 s", 1.5, 0.01, "θ of thigh and shank [rad]"),
        Scene("S4d", "compass gait, 16 s, 22 strikes", 16.0, 0.05, "θ of both legs and their rates", skipped=2e-3),
        Scene("S5", "elastic pendulum, 1e7 N/m, 5 s", 5.0, 0.1, "θ [rad] and stretch [m]"),
        Scene("S5b", "pendulum on a stop of 1e7 N/m, 3 s", 3.0, 0.01, "θ [rad]"),
        Scene("S7_top", "heavy top with nutation, 1 s", 1.0, 0.05, "direction of its axis [-]"),
        Scene("S7_double", "double pendulum on ball joints, 3 s", 3.0, 0.1, "centers of mass [m]"),
        Scene("S7_chain", "chain of 8 bars on ball joints, 0.6 s", 0.6, 0.02, "centers of mass [m]"),
        Scene("S7_human", "human in flight, 34 degrees of freedom, 0.5 s", 0.5, 0.05, "centers of mass [m]"),
        Scene("S7_coin", "rolling coin, 4 s", 4.0, 0.1, "center [m] and axis [-]"),
    )
}  # fmt: skip


def chosen(words: Sequence[str]) -> list[Scene]:
    """Scenes by name or family, all without words; 'S6', which is start-up, is no scene of these."""
    known = {*SCENES, *(scene.family for scene in SCENES.values()), "S6"}
    wrong = [word for word in words if word not in known]
    if wrong:
        raise ValueError(f"no scene {', '.join(map(repr, wrong))}; there are {', '.join([*SCENES, 'S6'])}")
    return [scene for scene in SCENES.values() if not words or {scene.name, scene.family} & set(words)]
