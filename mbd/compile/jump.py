"""Machine code of loops over tables, each made once, and jumps to it that know their tables."""

import ctypes
import weakref

from mbd.compile.llvm import Machine, cached_object, emit_object

AT_ONCE = 64
"""Jumps that are made together."""

SUM = """
define internal void @loop(ptr %block, ptr %parameters, ptr %out, ptr %plan) {
enter:
  %cleared = load i64, ptr %plan
  %at.count = getelementptr i64, ptr %plan, i64 1
  %count = load i64, ptr %at.count
  %at.others = getelementptr i64, ptr %plan, i64 2
  %n.others = load i64, ptr %at.others
  %at.list = getelementptr i64, ptr %plan, i64 3
  %others = load ptr, ptr %at.list
  %at.most = getelementptr i64, ptr %plan, i64 4
  %most = load i64, ptr %at.most
  %at.inputs = getelementptr i64, ptr %plan, i64 5
  %most.inputs = load i64, ptr %at.inputs
  %at.parts = getelementptr i64, ptr %plan, i64 6
  %parts = load i64, ptr %at.parts
  %room = add i64 %most, %most.inputs
  %room.bytes = mul i64 %room, 8
  %work = call ptr @malloc(i64 %room.bytes)
  %inputs = getelementptr double, ptr %work, i64 %most
  %bytes = mul i64 %count, 8
  %stretch = getelementptr double, ptr %out, i64 %cleared
  call ptr @memset(ptr %stretch, i32 0, i64 %bytes)
  br label %other
other:
  %c = phi i64 [ 0, %enter ], [ %c.next, %clear ]
  %uncleared = icmp slt i64 %c, %n.others
  br i1 %uncleared, label %clear, label %next
clear:
  %at.other = getelementptr i64, ptr %others, i64 %c
  %other.place = load i64, ptr %at.other
  %to.clear = getelementptr double, ptr %out, i64 %other.place
  store double 0.0, ptr %to.clear
  %c.next = add i64 %c, 1
  br label %other
next:
  %k = phi i64 [ 0, %other ], [ %k.next, %done ]
  %more = icmp slt i64 %k, %parts
  br i1 %more, label %part, label %leave
part:
  %before = mul i64 %k, 6
  %first = add i64 %before, 7
  %entry = getelementptr i64, ptr %plan, i64 %first
  %code = load ptr, ptr %entry
  %at.n = getelementptr i64, ptr %entry, i64 1
  %n = load i64, ptr %at.n
  %at.places = getelementptr i64, ptr %entry, i64 2
  %places = load ptr, ptr %at.places
  %at.b = getelementptr i64, ptr %entry, i64 3
  %b = load i64, ptr %at.b
  %at.all = getelementptr i64, ptr %entry, i64 4
  %all = load i64, ptr %at.all
  %at.sources = getelementptr i64, ptr %entry, i64 5
  %sources = load ptr, ptr %at.sources
  %own = icmp sgt i64 %all, 0
  %numbers = select i1 %own, ptr %inputs, ptr %block
  br label %from.block
from.block:
  %j = phi i64 [ 0, %part ], [ %j.next, %take ]
  %in.block = icmp slt i64 %j, %b
  br i1 %in.block, label %take, label %from.parameters
take:
  %at.source = getelementptr i64, ptr %sources, i64 %j
  %source = load i64, ptr %at.source
  %at.number = getelementptr double, ptr %block, i64 %source
  %number = load double, ptr %at.number
  %at.input = getelementptr double, ptr %inputs, i64 %j
  store double %number, ptr %at.input
  %j.next = add i64 %j, 1
  br label %from.block
from.parameters:
  %l = phi i64 [ %b, %from.block ], [ %l.next, %take.parameter ]
  %in.parameters = icmp slt i64 %l, %all
  br i1 %in.parameters, label %take.parameter, label %call
take.parameter:
  %at.where = getelementptr i64, ptr %sources, i64 %l
  %where = load i64, ptr %at.where
  %at.parameter = getelementptr double, ptr %parameters, i64 %where
  %parameter = load double, ptr %at.parameter
  %at.own = getelementptr double, ptr %inputs, i64 %l
  store double %parameter, ptr %at.own
  %l.next = add i64 %l, 1
  br label %from.parameters
call:
  call void %code(ptr %numbers, ptr %parameters, ptr %work)
  br label %add
add:
  %i = phi i64 [ 0, %call ], [ %i.next, %put ]
  %left = icmp slt i64 %i, %n
  br i1 %left, label %put, label %done
put:
  %at.place = getelementptr i64, ptr %places, i64 %i
  %place = load i64, ptr %at.place
  %from = getelementptr double, ptr %work, i64 %i
  %value = load double, ptr %from
  %to = getelementptr double, ptr %out, i64 %place
  %old = load double, ptr %to
  %sum = fadd double %old, %value
  store double %sum, ptr %to
  %i.next = add i64 %i, 1
  br label %add
done:
  %k.next = add i64 %k, 1
  br label %next
leave:
  call void @free(ptr %work)
  ret void
}
declare ptr @memset(ptr, i32, i64)
declare ptr @malloc(i64)
declare void @free(ptr)
"""
"""Clears the output, gives each part its inputs, calls it, and adds what it writes; the plan is that of `Composed`."""

PLANS = """
@plans = internal global [{number} x ptr] zeroinitializer
define ptr @mbd.plans() {{
  ret ptr @plans
}}
"""
JUMP = """
define void @mbd.jump.{k}(ptr %block, ptr %parameters, ptr %out) {{
  %at = getelementptr ptr, ptr @plans, i64 {k}
  %plan = load ptr, ptr %at
  tail call void @loop(ptr %block, ptr %parameters, ptr %out, ptr %plan)
  ret void
}}
"""


class Jump:
    """A function (block, parameters, out) by a plan.

    Parameters
    ----------
    plan : its address; it lives as long as this does
    loop : text of the function ``loop(block, parameters, out, plan)``, by default that of `Composed`
    """

    def __init__(self, plan: int, loop: str = SUM) -> None:
        free = _FREE.setdefault(loop, [])
        if not free:
            _make_more(loop, free)
        self.address, slot = free.pop()
        slot.value = plan
        weakref.finalize(self, free.append, (self.address, slot))


_FREE: dict[str, list[tuple[int, ctypes.c_uint64]]] = {}
"""Jumps that nobody has, with the places of their plans, by the loop."""
_MACHINES: list[Machine] = []
"""What holds all jumps until the process ends."""


def _make_more(loop: str, free: list[tuple[int, ctypes.c_uint64]]) -> None:
    text = loop + PLANS.format(number=AT_ONCE) + "".join(JUMP.format(k=k) for k in range(AT_ONCE))
    machine = Machine()
    names = ["mbd.plans", *(f"mbd.jump.{k}" for k in range(AT_ONCE))]
    plans, *jumps = machine.load(cached_object(text, lambda: emit_object(text), lasting=True), names)
    _MACHINES.append(machine)
    first = ctypes.CFUNCTYPE(ctypes.c_uint64)(plans)()
    free.extend((jump, ctypes.c_uint64.from_address(first + 8 * k)) for k, jump in enumerate(jumps))
