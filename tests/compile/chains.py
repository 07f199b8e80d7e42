"""Plain planar chains of n links, written out as a recursion on the tape: the graphs that compilers are tested on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mbd.compile.cache import ObjectCache
from mbd.compile.layout import Layout
from mbd.compile.llvm import LEVEL, Library
from mbd.tape.derivatives import jvp
from mbd.tape.functions import cos, sin
from mbd.tape.node import Node, Scalar, Tape


@dataclass(frozen=True)
class Chain:
    """n hinged rods: balance ``r(q, v, a)``, tangent ``S = M + c_C C_t + c_K K_t`` row by row, and energy T + V."""

    tape: Tape
    layout: Layout
    balance: tuple[Node, ...]
    tangent: tuple[Node, ...]
    energy: Node

    @property
    def outputs(self) -> list[Node]:
        return [*self.balance, *self.tangent]


def chain(n: int) -> Chain:
    """The chain with relative angles q + x, lengths l, masses m and inertias j as parameters, center at mid-length."""
    tape = Tape()
    gravity = tape.input("p", 0)
    x = [tape.input("x", i) for i in range(n)]
    q = [tape.input("q", i) + x[i] for i in range(n)]
    v = [tape.input("v", i) for i in range(n)]
    a = [tape.input("a", i) for i in range(n)]
    mass, length, inertia = ([tape.input("p", 1 + kind * n + i) for i in range(n)] for kind in range(3))

    c, s, omega, alpha = tape.one, tape.zero, tape.zero, tape.zero
    start: tuple[Scalar, Scalar] = (tape.zero, gravity)  # gravity as an acceleration of the suspension
    height: Scalar = tape.zero
    speed: tuple[Scalar, Scalar] = (tape.zero, tape.zero)
    forces: list[tuple[Node, Node, Node, Node, Node]] = []
    energy: Scalar = 0.0
    for i in range(n):
        ci, si = cos(q[i]), sin(q[i])
        c, s = c * ci - s * si, s * ci + c * si
        omega, alpha = omega + v[i], alpha + a[i]
        x_arm, y_arm = length[i] * s, -(length[i] * c)
        span = (-alpha * y_arm - omega * omega * x_arm, alpha * x_arm - omega * omega * y_arm)
        center = (start[0] + 0.5 * span[0], start[1] + 0.5 * span[1])
        forces.append((mass[i] * center[0], mass[i] * center[1], inertia[i] * alpha, x_arm, y_arm))
        start = (start[0] + span[0], start[1] + span[1])
        middle = (speed[0] - 0.5 * omega * y_arm, speed[1] + 0.5 * omega * x_arm)
        energy = energy + 0.5 * (mass[i] * (middle[0] * middle[0] + middle[1] * middle[1]) + inertia[i] * omega * omega)
        energy = energy + mass[i] * gravity * (height + 0.5 * y_arm)
        speed, height = (speed[0] - omega * y_arm, speed[1] + omega * x_arm), height + y_arm

    balance: list[Node] = []
    fx, fy, moment = tape.zero, tape.zero, tape.zero
    for px, py, spin, x_arm, y_arm in reversed(forces):
        moment = moment + spin + (x_arm * fy - y_arm * fx) + 0.5 * (x_arm * py - y_arm * px)
        fx, fy = fx + px, fy + py
        balance.append(moment)
    balance.reverse()

    c_c, c_k = tape.input("c", 0), tape.input("c", 1)
    columns = [jvp(balance, {a[j]: 1.0, v[j]: c_c, x[j]: c_k}) for j in range(n)]
    tangent = [columns[j][i] for i in range(n) for j in range(n)]
    layout = Layout(n, n, 0, 0, 0, 0, 1 + 3 * n)
    return Chain(tape, layout, tuple(balance), tuple(tangent), tape.lift(energy))


def compile_functions(
    programs: Mapping[str, Sequence[Node]], layout: Layout, level: int = LEVEL, cache: ObjectCache | None = None
) -> Library:
    """A library with one function per program, all in one object file.

    Parameters
    ----------
    programs : names and what each function writes to ``out``
    level : optimization level 0 … 3
    cache : where object files are kept; that of the user by default, ``ObjectCache()`` for none
    """
    library = Library(layout, level, cache)
    library.add(programs)
    return library
