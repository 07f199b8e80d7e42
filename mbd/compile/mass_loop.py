"""The program `accelerations` of a large tree, whose mass matrix is filled by a loop behind straight-line code."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.compile.backend import Function
from mbd.equations.composite_mass import entry, passed_down
from mbd.trees.llvm import HEAD, Writer

OF_BODY, OF_COORDINATE = 12, 12
"""Numbers of a body and of a coordinate, see `mbd.equations.composite_mass.MassLoop`."""


class WithMasses:
    """Straight-line code and then ``M_ij = M_ji = f_j · l_i + n_j · ω_i`` for each coordinate j and all i below it.

    Parameters
    ----------
    straight : writes everything else, and from `first` on the numbers of the loop
    n : size of M (n × n), with which the output begins
    bodies : see `mbd.equations.composite_mass.MassLoop`
    """

    def __init__(self, straight: Function, n: int, bodies: Sequence[tuple[int, int, int]]) -> None:
        self.name, self.size = straight.name, straight.size
        self._straight, self._n, self._bodies = straight, n, np.array(bodies, dtype=np.int64).reshape(-1, 3)
        coordinates = int(np.sum(self._bodies[:, 2] - self._bodies[:, 1]))
        self._at_coordinates = self.size - OF_COORDINATE * coordinates
        self._at_bodies = self._at_coordinates - OF_BODY * len(bodies)
        head = [0, n, len(bodies), self._at_bodies, self._at_coordinates]
        self._plan = np.array([*head, *self._bodies.ravel()], dtype=np.int64)

    @property
    def provisional(self) -> bool:
        """Whether better code is being made."""
        return self._straight.provisional

    @property
    def address(self) -> int:
        """Of a jump to the loop, which calls the best straight code that there is now; 0 in plain Python."""
        self._plan[0] = self._straight.address
        return int(self._jump.address) if self._plan[0] else 0

    @cached_property
    def _jump(self) -> Any:
        from mbd.compile.jump import Jump

        return Jump(self._plan.ctypes.data, loop_text())

    def __call__(self, block: Vector, parameters: Vector, out: Vector) -> None:
        if address := self.address:
            from mbd.compile.llvm import call

            self._straight.require_room(block, parameters, out)  # type: ignore[attr-defined]
            call(address)(block, parameters, out)
        else:
            self._straight(block, parameters, out)
            self._fill(out)

    def _fill(self, out: Vector) -> None:
        """M from the numbers of the loop; for all coordinates at once, one body further down each time."""
        M, coordinates = out[: self._n**2].reshape(self._n, self._n), out[self._at_coordinates : self.size]
        turns, places = _parts(out[self._at_bodies : self._at_coordinates].reshape(-1, OF_BODY).T)
        force, torque, angular, linear = _vectors(coordinates.reshape(-1, OF_COORDINATE).T)
        parents, first, end = self._bodies.T
        own = np.repeat(np.arange(len(first)), end - first)  # body of each coordinate, in the order of bodies
        j = np.concatenate([np.arange(a, b) for a, b in zip(first, end, strict=True)]).astype(np.int64)
        below, force, torque = own, _at(force, j), _at(torque, j)
        while len(j):
            for k in range(int(np.max(end[below] - first[below]))):
                i = first[below] + k
                there = (i < end[below]) & ((below != own) | (i <= j))
                i, of = i[there], j[there]
                M[i, of] = M[of, i] = entry(_at(force, there), _at(torque, there), _at(angular, i), _at(linear, i))
            more = parents[below] >= 0
            below, own, j, force, torque = below[more], own[more], j[more], _at(force, more), _at(torque, more)
            turn: Any = tuple(_at(line, below) for line in turns)
            force, torque = passed_down(turn, _at(places, below), force, torque)
            below = parents[below]


def _vectors(numbers: NDArray[np.float64]) -> list[Any]:
    """Triples of columns from their components, one line each."""
    return [tuple(numbers[k : k + 3]) for k in range(0, len(numbers), 3)]


def _parts(numbers: NDArray[np.float64]) -> tuple[Any, Any]:
    """R and the place of each body."""
    *turn, place = _vectors(numbers)
    return turn, place


def _at(triple: Any, chosen: Any) -> Any:
    return tuple(part[chosen] for part in triple)


class _Real:
    """A number in LLVM's words, whose operations are written as they are asked for."""

    def __init__(self, name: str, writer: Writer) -> None:
        self.name, self.writer = name, writer

    def _with(self, operator: str, other: _Real) -> _Real:
        return _Real(self.writer.operation(operator, self.name, other.name, "real"), self.writer)

    def __add__(self, other: _Real) -> _Real:
        return self._with("+", other)

    def __sub__(self, other: _Real) -> _Real:
        return self._with("-", other)

    def __mul__(self, other: _Real) -> _Real:
        return self._with("*", other)


LOOP = """
define internal void @loop(ptr %block, ptr %parameters, ptr %out, ptr %plan) {{
enter:
  %code = load ptr, ptr %plan
  %at.n = getelementptr i64, ptr %plan, i64 1
  %n = load i64, ptr %at.n
  %at.bodies = getelementptr i64, ptr %plan, i64 2
  %bodies = load i64, ptr %at.bodies
  %at.first = getelementptr i64, ptr %plan, i64 3
  %first = load i64, ptr %at.first
  %at.second = getelementptr i64, ptr %plan, i64 4
  %second = load i64, ptr %at.second
  %lines = getelementptr i64, ptr %plan, i64 5
  call void %code(ptr %block, ptr %parameters, ptr %out)
  %of.bodies = getelementptr double, ptr %out, i64 %first
  %of.coordinates = getelementptr double, ptr %out, i64 %second
  br label %body
body:
  %b = phi i64 [ 0, %enter ], [ %b.next, %body.done ]
  %b.more = icmp slt i64 %b, %bodies
  br i1 %b.more, label %coordinates, label %leave
coordinates:
  %b.line = getelementptr [3 x i64], ptr %lines, i64 %b
  %at.b.first = getelementptr i64, ptr %b.line, i64 1
  %b.first = load i64, ptr %at.b.first
  %at.b.end = getelementptr i64, ptr %b.line, i64 2
  %b.end = load i64, ptr %at.b.end
  br label %coordinate
coordinate:
  %j = phi i64 [ %b.first, %coordinates ], [ %j.next, %coordinate.done ]
  %j.more = icmp slt i64 %j, %b.end
  br i1 %j.more, label %load, label %body.done
load:
  %j.next = add i64 %j, 1
  %of.j = getelementptr [12 x double], ptr %of.coordinates, i64 %j
{load}
  br label %below
below:
  %a = phi i64 [ %b, %load ], [ %parent, %pass ]
{carried}
  %a.line = getelementptr [3 x i64], ptr %lines, i64 %a
  %at.a.first = getelementptr i64, ptr %a.line, i64 1
  %a.first = load i64, ptr %at.a.first
  %at.a.end = getelementptr i64, ptr %a.line, i64 2
  %a.end = load i64, ptr %at.a.end
  %own = icmp eq i64 %a, %b
  %end = select i1 %own, i64 %j.next, i64 %a.end
  br label %line
line:
  %i = phi i64 [ %a.first, %below ], [ %i.next, %fill ]
  %i.more = icmp slt i64 %i, %end
  br i1 %i.more, label %fill, label %next
fill:
  %i.next = add i64 %i, 1
  %of.i = getelementptr [12 x double], ptr %of.coordinates, i64 %i
{fill}
  %i.line = mul i64 %i, %n
  %ij = add i64 %i.line, %j
  %at.ij = getelementptr double, ptr %out, i64 %ij
  store double {value}, ptr %at.ij
  %j.line = mul i64 %j, %n
  %ji = add i64 %j.line, %i
  %at.ji = getelementptr double, ptr %out, i64 %ji
  store double {value}, ptr %at.ji
  br label %line
next:
  %parent = load i64, ptr %a.line
  %again = icmp sge i64 %parent, 0
  br i1 %again, label %pass, label %coordinate.done
pass:
  %of.a = getelementptr [12 x double], ptr %of.bodies, i64 %a
{pass_down}
  br label %below
coordinate.done:
  br label %coordinate
body.done:
  %b.next = add i64 %b, 1
  br label %body
leave:
  ret void
}}
"""
"""Calls the straight code, and fills M; arithmetic is that of `mbd.equations.composite_mass`."""


@cache
def loop_text() -> str:
    """The loop in LLVM's words."""

    def loaded(writer: Writer, array: str, first: int, count: int) -> list[Any]:
        found = []
        for k in range(first, first + count):
            address = writer.emit(f"getelementptr double, ptr {array}, i64 {k}")
            found.append(_Real(writer.emit(f"load double, ptr {address}"), writer))
        return [tuple(found[k : k + 3]) for k in range(0, count, 3)]

    def text(writer: Writer) -> str:
        return "\n".join(f"  {line}" for line in writer.lines)

    load, fill, pass_down = Writer(), Writer(), Writer()
    fill.count, pass_down.count = 1000, 2000  # names are not those of the others
    start = [part for triple in loaded(load, "%of.j", 0, 6) for part in triple]
    force, torque = ([_Real(f"%{what}{k}", pass_down) for k in range(3)] for what in ("force.", "torque."))
    angular, linear = loaded(fill, "%of.i", 6, 6)
    own: Any = [tuple(_Real(part.name, fill) for part in each) for each in (force, torque)]
    value: Any = entry(own[0], own[1], angular, linear)
    *turn, place = loaded(pass_down, "%of.a", 0, 12)
    passed: Any = passed_down(tuple(turn), place, tuple(force), tuple(torque))  # type: ignore[arg-type]
    carried = [
        f"  {now.name} = phi double [ {first.name}, %load ], [ {after.name}, %pass ]"
        for now, first, after in zip((*force, *torque), start, (*passed[0], *passed[1]), strict=True)
    ]
    return HEAD + LOOP.format(
        load=text(load), carried="\n".join(carried), fill=text(fill), value=value.name, pass_down=text(pass_down)
    )
