"""Which integrators of `mbd` run which scene, with which steps or tolerances: one table.

A scheme that this version of `mbd` does not have is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mbd
from benchmarks.peers.scenes import Scene


@dataclass(frozen=True)
class Scheme:
    """An integrator by its name in `mbd`, its arguments, and the steps [s] and tolerances to try, coarse to fine."""

    name: str
    arguments: tuple[float, ...] = ()
    dts: tuple[float, ...] = ()
    tols: tuple[float, ...] = ()

    @property
    def exists(self) -> bool:
        return hasattr(mbd, self.name)


@dataclass(frozen=True)
class Setting:
    """An integrator with dt or tol, as `simulate` takes them."""

    integrator: Any
    words: dict[str, float]

    @property
    def label(self) -> str:
        ((word, value),) = self.words.items()
        return f"{self.integrator!r} {word}={value:g}".replace(", formulation='ggl', start='jerk'", "")


def down(first: float, last: float, ratio: float = 0.5) -> tuple[float, ...]:
    """A geometric row from `first` to about `last`; ratio 0.5 gives 1, ½, ¼, …"""
    values = [first]
    while values[-1] * ratio > 0.99 * last:
        values.append(values[-1] * ratio)
    return tuple(values)


TOLS = down(1e-3, 1e-10, 0.1)
TRAPEZOID, DAMPED, UNDAMPED = ("GeneralizedAlpha", (1.0,)), ("GeneralizedAlpha", (0.9,)), ("HHT", (0.0,))
RK, RADAU = "RungeKutta853", "RadauIIA"

TABLE: dict[str, tuple[Scheme, ...]] = {
    "S1": (
        Scheme(*TRAPEZOID, dts=down(4e-3, 1e-5)),
        Scheme(*DAMPED, dts=down(1e-3, 2e-4)),
        Scheme(RK, dts=down(0.1, 0.0125), tols=TOLS),
        Scheme(RADAU, dts=down(0.05, 3e-3), tols=TOLS),
    ),
    "S2": (
        Scheme(*TRAPEZOID, dts=down(4e-3, 1e-5)),
        Scheme(RK, dts=down(0.02, 6e-4), tols=TOLS),
        Scheme(RADAU, dts=down(0.02, 6e-4), tols=TOLS),
    ),
    "S3a": (
        Scheme(*TRAPEZOID, dts=down(0.02, 1e-4)),
        Scheme(*DAMPED, dts=down(0.02, 1e-4)),
        Scheme(RK, dts=down(0.05, 6e-3), tols=TOLS),
        Scheme(RADAU, dts=down(0.05, 6e-3), tols=TOLS),
    ),
    "S3b": (
        Scheme(*TRAPEZOID, dts=down(1e-4, 2e-7)),
        Scheme(*DAMPED, dts=down(1e-4, 2e-7)),
        Scheme(RK, dts=down(1e-3, 1e-4), tols=TOLS),
        Scheme(RADAU, dts=down(1e-3, 3e-5), tols=TOLS),
    ),
    "S4a": (
        Scheme(*UNDAMPED, dts=down(5e-2, 5e-3)),
        Scheme(RK, dts=(5e-2,), tols=TOLS[::3]),
    ),
    "S4b": (
        Scheme(*UNDAMPED, dts=down(0.04, 1e-5)),
        Scheme(RK, dts=down(0.2, 0.02), tols=TOLS),
        Scheme(RADAU, dts=down(0.1, 0.01), tols=TOLS),
    ),
    "S4c": (
        Scheme(*UNDAMPED, dts=down(1e-2, 1e-5)),
        Scheme(RK, dts=down(0.05, 0.01), tols=TOLS),
        Scheme(RADAU, dts=down(0.02, 2.5e-3), tols=TOLS),
    ),
    "S4d": (
        Scheme(*UNDAMPED, dts=down(4e-3, 2e-5)),
        Scheme(RK, dts=down(0.1, 0.01), tols=TOLS),
        Scheme(RADAU, dts=down(0.05, 5e-3), tols=TOLS),
    ),
    "S5": (
        Scheme(*TRAPEZOID, dts=down(1e-2, 5e-6)),
        Scheme("GeneralizedAlpha", (0.5,), dts=down(1e-2, 1e-3)),
        Scheme(RK, dts=down(2e-3, 2e-4), tols=TOLS),
        Scheme(RADAU, dts=down(0.05, 6e-3), tols=TOLS),
    ),
    "S5b": (
        Scheme(*UNDAMPED, dts=down(1e-4, 5e-7)),
        Scheme(RK, dts=down(2e-3, 1e-4), tols=TOLS),
        Scheme(RADAU, dts=down(2e-3, 1e-4), tols=TOLS),
    ),
    "S7_top": (
        Scheme(*TRAPEZOID, dts=down(2e-3, 1e-5)),
        Scheme(RK, dts=(0.05 / 6, 0.00625, 0.005, 0.05 / 12, 0.003125, 0.0025, 0.05 / 24, 0.05 / 32), tols=TOLS),
        Scheme(RADAU, dts=down(0.00625, 4e-4), tols=TOLS),
    ),
    "S7_double": (
        Scheme(*TRAPEZOID, dts=down(0.02, 1e-4)),
        Scheme(RK, dts=(0.2, 0.15, 0.125, 0.1, 0.05, 0.1 / 3, 0.025, 0.02, 0.1 / 6, 0.0125, 0.01), tols=TOLS),
        Scheme(RADAU, dts=down(0.05, 3e-3), tols=TOLS),
    ),
    "S7_top, hinges": (Scheme(RK, dts=(0.05, 0.05 / 2, 0.05 / 3, 0.0125, 0.01, 0.05 / 6, 0.00625, 0.005, 0.0025)),),
    "S7_double, hinges": (Scheme(RK, dts=(0.1, 0.05, 0.1 / 3, 0.025, 0.02, 0.0125, 0.01)),),
    "S7_chain, hinges": (Scheme(RK, dts=(0.02, 0.01, 0.02 / 3, 0.005, 0.004, 0.0025)),),
    "S7_chain": (
        Scheme(*TRAPEZOID, dts=down(0.01, 1e-4)),
        Scheme("RungeKutta4", dts=(0.01, 0.6 / 75, 0.6 / 88, 0.02 / 3, 0.005, 0.004, 0.0025)),
        Scheme(RK, dts=(0.02, 0.6 / 34, 0.6 / 38, 0.6 / 44, 0.01, 0.02 / 3, 0.005, 0.004, 0.02 / 6, 0.0025), tols=TOLS),
        Scheme(RADAU, dts=down(0.02, 1e-3), tols=TOLS),
    ),
    "S7_human": (
        Scheme(*TRAPEZOID, dts=down(0.025, 5e-4)),
        Scheme(RK, dts=(0.25, 0.5 / 3, 0.125, 0.1, 0.5 / 6, 0.0625, 0.05, 0.025, 0.05 / 3, 0.0125), tols=TOLS),
        Scheme(RADAU, dts=down(0.025, 6e-3), tols=TOLS),
    ),
    "S7_coin": (
        Scheme(*TRAPEZOID, dts=down(0.02, 1e-4)),
        Scheme(RK, dts=(0.25, 0.2, 0.16, 0.125, 0.1, 0.05, 0.1 / 3, 0.025, 0.02, 0.1 / 6, 0.0125), tols=TOLS),
        Scheme(RADAU, dts=down(0.1, 6e-3), tols=TOLS),
    ),
}  # fmt: skip
"""By scene or family."""
TABLE["S1d"] = TABLE["S1"]


def settings(scene: Scene, by_hinges: bool = False) -> list[list[Setting]]:
    """The sweeps of a scene, with the schemes that exist; of one in space those of its model `by_hinges`."""
    sweeps = []
    name = f"{scene.name}, hinges" if by_hinges else scene.name
    for scheme in TABLE.get(name, TABLE.get(scene.family, ())):
        if scheme.exists:
            integrator = getattr(mbd, scheme.name)(*scheme.arguments)
            sweeps.append([Setting(integrator, {"dt": dt}) for dt in scheme.dts])
            sweeps.append([Setting(integrator, {"tol": tol}) for tol in scheme.tols])
    return [sweep for sweep in sweeps if sweep]
