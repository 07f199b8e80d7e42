"""Sine and cosine of several angles at once as LLVM IR, of one as C: the same operations, and the same bits.

A mechanism asks for the sines and cosines of all its angles together, so they are computed in one vector
register: four angles take 7 ns where four calls of a C library's ``sincos`` take 38 ns. Every width does the same
operations on each lane, so a further angle changes no bit of the others.

With ``n = round(2 x/π)`` the angle is reduced to ``r = x − n π/2`` (Cody & Waite 1980), π/2 in three parts of which
the first two have 33 bits, so that their products with n are exact; what r loses to rounding is kept as a
correction c. Then, z = r²,

    sin(r − c) = r − (r z Q(z) + c (1 − z/2)),    cos(r − c) = 1 − z/2 + (z² K(z) + r c)

where Q and K are minimax polynomials on |r| ≤ π/4 (Remez exchange; error below 2⁻⁵⁷ and 2⁻⁶³). Bits of n exchange
the two and set their signs. The largest error is 0.76 units in the last place. Lanes of |x| ≥ 2²⁰ (and NaN, ∞) are
taken from the C library.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from struct import pack

WIDTHS = (1, 2, 4)
"""Numbers of angles for which there is a function; more angles take several calls."""

LIMIT = 2.0**20
"""Angles beyond this go to the C library: n must stay below 2²⁰ for exact products."""

SHIFT = 1.5 * 2.0**52
"""Adding and subtracting this rounds to the nearest integer, which stands in the low bits of the sum."""

TWO_OVER_PI = float.fromhex("0x1.45f306dc9c883p-1")

HALF_PI = tuple(
    float.fromhex(part) for part in ("0x1.921fb54400000p+0", "0x1.0b4611a600000p-34", "0x1.3198a2e037073p-69")
)
"""π/2 = their sum, to 119 bits."""

SINE = tuple(
    float.fromhex(c)
    for c in (
        "0x1.5555555555548p-3", "-0x1.111111110f7cap-7", "0x1.a01a019bfd179p-13", "-0x1.71de356711e88p-19",
        "0x1.ae5e59f537bdfp-26", "-0x1.5d8fa303c4cb6p-33",
    )
)  # fmt: skip
"""Q, lowest power first: (r − sin r)/r³ on z = r²."""

COSINE = tuple(
    float.fromhex(c)
    for c in (
        "0x1.555555555554bp-5", "-0x1.6c16c16c14f8ap-10", "0x1.a01a019c83916p-16", "-0x1.27e4f7ea37e58p-22",
        "0x1.1ee9d752c6eeep-29", "-0x1.8fa4660971550p-37",
    )
)  # fmt: skip
"""K, lowest power first: (cos r − 1 + z/2)/z² on z = r²."""


class _Real:
    """A number in a target's words; its operations are written as they are asked for."""

    def __init__(self, text: str, writer: _Writer) -> None:
        self.text, self.writer = text, writer

    def __add__(self, other: _Real | float) -> _Real:
        return self.writer.operation("add", self, other)

    def __sub__(self, other: _Real | float) -> _Real:
        return self.writer.operation("sub", self, other)

    def __rsub__(self, other: float) -> _Real:
        return self.writer.operation("sub", other, self)

    def __mul__(self, other: _Real | float) -> _Real:
        return self.writer.operation("mul", self, other)


class _Writer(ABC):
    """Writes operations, one name each; a target says how."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.count = 0

    @abstractmethod
    def number(self, value: float) -> str: ...
    @abstractmethod
    def write(self, operation: str, a: str, b: str) -> str: ...
    @abstractmethod
    def bits(self, value: str) -> str:
        """The bits of a real as an integer."""

    @abstractmethod
    def following(self, n: str) -> str:
        """n + 1."""

    @abstractmethod
    def choose_by_bit_zero(self, n: str, a: str, b: str) -> str: ...
    @abstractmethod
    def negate_on_bit_one(self, value: str, n: str) -> str: ...

    def text(self, value: _Real | float) -> str:
        return value.text if isinstance(value, _Real) else self.number(value)

    def operation(self, operation: str, a: _Real | float, b: _Real | float) -> _Real:
        return _Real(self.write(operation, self.text(a), self.text(b)), self)

    def mad(self, a: _Real, b: _Real | float, c: _Real | float) -> _Real:
        """a b + c, in one rounding where the machine can and may."""
        return a * b + c

    def polynomial(self, c: Sequence[float], z: _Real, zz: _Real) -> _Real:
        """Σ c_k z^k of degree 5 (Estrin's scheme)."""
        low, middle, high = (_Real(self.number(c[k + 1]), self) for k in (0, 2, 4))
        low, middle, high = (self.mad(part, z, c[2 * k]) for k, part in enumerate((low, middle, high)))
        return self.mad(self.mad(high, zz, middle), zz, low)

    def sine_and_cosine(self, angle: str) -> tuple[str, str]:
        """Those of a near angle."""
        x = _Real(angle, self)
        shifted = x * TWO_OVER_PI + SHIFT
        n, bits = shifted - SHIFT, self.bits(shifted.text)
        # the angle less n π/2, and what that lost
        first = x - n * HALF_PI[0]
        part = n * HALF_PI[1]
        second = first - part
        rest = n * HALF_PI[2]
        r = second - rest
        c = (part - (first - second)) + (rest - (second - r))
        # polynomials
        z = r * r
        zz, half = z * z, z * 0.5
        top = 1.0 - half
        sine = r - self.mad(r * z, self.polynomial(SINE, z, zz), c * top)
        tail = self.mad(zz, self.polynomial(COSINE, z, zz), r * c)
        cosine = top + ((1.0 - top - half) + tail)
        # exchanged and with their signs
        turned = self.following(bits)
        s = self.negate_on_bit_one(self.choose_by_bit_zero(bits, cosine.text, sine.text), bits)
        return s, self.negate_on_bit_one(self.choose_by_bit_zero(bits, sine.text, cosine.text), turned)


class _Lanes(_Writer):
    """LLVM's operations on `width` lanes at once."""

    def __init__(self, width: int, fused: bool) -> None:
        super().__init__()
        self.width, self.fused = width, fused
        self.type = f"<{width} x double>" if width > 1 else "double"
        self.integer = f"<{width} x i64>" if width > 1 else "i64"
        self.flag = f"<{width} x i1>" if width > 1 else "i1"
        self.suffix = f"v{width}f64" if width > 1 else "f64"
        self.pair = f"{{ {self.type}, {self.type} }}"

    def splat(self, value: str, kind: str) -> str:
        return value if self.width == 1 else f"<{', '.join([f'{kind} {value}'] * self.width)}>"

    def number(self, value: float) -> str:
        return self.splat(f"0x{pack('>d', value).hex()}", "double")

    def do(self, instruction: str) -> str:
        name = f"%r{self.count}"
        self.count += 1
        self.lines.append(f"{name} = {instruction}")
        return name

    def write(self, operation: str, a: str, b: str) -> str:
        return self.do(f"f{operation} {self.type} {a}, {b}")

    def mad(self, a: _Real, b: _Real | float, c: _Real | float) -> _Real:
        if not self.fused:
            return super().mad(a, b, c)
        given = ", ".join(f"{self.type} {self.text(each)}" for each in (a, b, c))
        return _Real(self.do(f"call {self.type} @llvm.fma.{self.suffix}({given})"), self)

    def is_near(self) -> str:
        """Whether |x| is below LIMIT, lane by lane."""
        size = self.do(f"call {self.type} @llvm.fabs.{self.suffix}({self.type} %x)")
        return self.do(f"fcmp olt {self.type} {size}, {self.number(LIMIT)}")

    def bits(self, value: str) -> str:
        return self.do(f"bitcast {self.type} {value} to {self.integer}")

    def following(self, n: str) -> str:
        return self.do(f"add {self.integer} {n}, {self.splat('1', 'i64')}")

    def choose(self, condition: str, a: str, b: str) -> str:
        return self.do(f"select {self.flag} {condition}, {self.type} {a}, {self.type} {b}")

    def choose_by_bit_zero(self, n: str, a: str, b: str) -> str:
        return self.choose(self.do(f"trunc {self.integer} {n} to {self.flag}"), a, b)

    def negate_on_bit_one(self, value: str, n: str) -> str:
        one = self.do(f"and {self.integer} {n}, {self.splat('2', 'i64')}")
        sign = self.do(f"shl {self.integer} {one}, {self.splat('62', 'i64')}")
        flipped = self.do(f"xor {self.integer} {self.bits(value)}, {sign}")
        return self.do(f"bitcast {self.integer} {flipped} to {self.type}")

    def library(self, name: str) -> str:
        """The C library's value on every lane."""
        if self.width == 1:
            return self.do(f"call double @{name}(double %x) nobuiltin")
        result = "poison"
        for lane in range(self.width):
            x = self.do(f"extractelement {self.type} %x, i64 {lane}")
            value = self.do(f"call double @{name}(double {x}) nobuiltin")
            result = self.do(f"insertelement {self.type} {result}, double {value}, i64 {lane}")
        return result

    def give(self, sine: str, cosine: str) -> None:
        half = self.do(f"insertvalue {self.pair} poison, {self.type} {sine}, 0")
        self.lines.append(f"ret {self.pair} {self.do(f'insertvalue {self.pair} {half}, {self.type} {cosine}, 1')}")


def sincos(width: int, fused: bool) -> tuple[list[str], Iterable[str]]:
    """Lines of ``{sin, cos} @mbd.sincos<width>(x)`` and the declarations it needs.

    Parameters
    ----------
    width : number of angles, one of `WIDTHS`
    fused : whether the machine has a fused multiply-add instruction
    """
    w = _Lanes(width, fused)
    kind, flag = w.type, w.flag
    w.lines.append(f"define internal fastcc {w.pair} @mbd.sincos{width}({kind} %x) nounwind noinline {{\nentry:")
    near, (sine, cosine) = w.is_near(), w.sine_and_cosine("%x")
    every = near if width == 1 else w.do(f"call i1 @llvm.vector.reduce.and.v{width}i1({flag} {near})")
    w.lines.append(f'br i1 {every}, label %fast, label %far, !prof !{{!"branch_weights", i32 1000000, i32 1}}\nfast:')
    w.give(sine, cosine)
    w.lines.append("far:")
    w.give(w.choose(near, sine, w.library("sin")), w.choose(near, cosine, w.library("cos")))
    w.lines.append("}")
    needs = [f"declare {kind} @llvm.fabs.{w.suffix}({kind})"]
    needs += [f"declare double @{n}(double) nounwind nobuiltin willreturn memory(none)" for n in ("sin", "cos")]
    if width > 1:
        needs.append(f"declare i1 @llvm.vector.reduce.and.v{width}i1({flag})")
    if fused:
        needs.append(f"declare {kind} @llvm.fma.{w.suffix}({kind}, {kind}, {kind})")
    return w.lines, needs


class _InC(_Writer):
    """C's operations on one angle."""

    def do(self, kind: str, expression: str) -> str:
        name = f"r{self.count}"
        self.count += 1
        self.lines.append(f"    const {kind} {name} = {expression};")
        return name

    def number(self, value: float) -> str:
        return f"({value.hex()})"

    def write(self, operation: str, a: str, b: str) -> str:
        return self.do("double", f"{a} {'+' if operation == 'add' else '-' if operation == 'sub' else '*'} {b}")

    def bits(self, value: str) -> str:
        name = self.do("double", value)
        self.lines.append(f"    uint64_t bits;\n    memcpy(&bits, &{name}, 8);")
        return "bits"

    def following(self, n: str) -> str:
        return f"({n} + 1)"

    def choose_by_bit_zero(self, n: str, a: str, b: str) -> str:
        return self.do("double", f"{n} & 1 ? {a} : {b}")

    def negate_on_bit_one(self, value: str, n: str) -> str:
        return self.do("double", f"{n} & 2 ? -{value} : {value}")


def sincos_in_c() -> str:
    """The function ``sine_and_cosine(x, &sine, &cosine)``, with the bits of `sincos` where that is not fused."""
    w = _InC()
    sine, cosine = w.sine_and_cosine("x")
    return "\n".join(
        [
            "static void sine_and_cosine(double x, double *sine, double *cosine)",
            "{",
            f"    if (!(fabs(x) < {w.number(LIMIT)})) {{ *sine = sin(x); *cosine = cos(x); return; }}",
            *w.lines,
            f"    *sine = {sine};",
            f"    *cosine = {cosine};",
            "}",
        ]
    )
