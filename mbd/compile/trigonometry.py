"""Sine and cosine of several angles at once, as LLVM IR.

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

from collections.abc import Iterable, Sequence
from struct import pack

__all__ = ["WIDTHS", "constant", "sincos"]

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


def constant(value: float) -> str:
    """A double in LLVM's exact notation."""
    return f"0x{pack('>d', value).hex().upper()}"


class _Lanes:
    """Writes operations on `width` lanes at once."""

    def __init__(self, width: int, fused: bool) -> None:
        self.width, self.fused = width, fused
        self.lines: list[str] = []
        self.real = f"<{width} x double>" if width > 1 else "double"
        self.bits = f"<{width} x i64>" if width > 1 else "i64"
        self.flag = f"<{width} x i1>" if width > 1 else "i1"
        self.suffix = f"v{width}f64" if width > 1 else "f64"
        self.pair = f"{{ {self.real}, {self.real} }}"
        self.count = 0

    def splat(self, value: str, kind: str) -> str:
        return value if self.width == 1 else f"<{', '.join([f'{kind} {value}'] * self.width)}>"

    def number(self, value: float) -> str:
        return self.splat(constant(value), "double")

    def integer(self, value: int) -> str:
        return self.splat(str(value), "i64")

    def do(self, instruction: str) -> str:
        name = f"%r{self.count}"
        self.count += 1
        self.lines.append(f"{name} = {instruction}")
        return name

    def add(self, a: str, b: str) -> str:
        return self.do(f"fadd {self.real} {a}, {b}")

    def sub(self, a: str, b: str) -> str:
        return self.do(f"fsub {self.real} {a}, {b}")

    def mul(self, a: str, b: str) -> str:
        return self.do(f"fmul {self.real} {a}, {b}")

    def mad(self, a: str, b: str, c: str) -> str:
        """a b + c, in one rounding where the machine can."""
        if self.fused:
            t = self.real
            return self.do(f"call {t} @llvm.fma.{self.suffix}({t} {a}, {t} {b}, {t} {c})")
        return self.add(self.mul(a, b), c)

    def choose(self, condition: str, a: str, b: str) -> str:
        return self.do(f"select {self.flag} {condition}, {self.real} {a}, {self.real} {b}")

    def polynomial(self, c: Sequence[float], z: str, zz: str) -> str:
        """Σ c_k z^k of degree 5 (Estrin's scheme)."""
        low, middle, high = (self.mad(self.number(c[k + 1]), z, self.number(c[k])) for k in (0, 2, 4))
        return self.mad(self.mad(high, zz, middle), zz, low)

    def negate_on_bit_one(self, value: str, n: str) -> str:
        sign = self.do(f"shl {self.bits} {self.do(f'and {self.bits} {n}, {self.integer(2)}')}, {self.integer(62)}")
        as_bits = self.do(f"bitcast {self.real} {value} to {self.bits}")
        flipped = self.do(f"xor {self.bits} {as_bits}, {sign}")
        return self.do(f"bitcast {self.bits} {flipped} to {self.real}")

    def give(self, sine: str, cosine: str) -> None:
        half = self.do(f"insertvalue {self.pair} poison, {self.real} {sine}, 0")
        self.lines.append(f"ret {self.pair} {self.do(f'insertvalue {self.pair} {half}, {self.real} {cosine}, 1')}")


def sincos(width: int, fused: bool) -> tuple[list[str], Iterable[str]]:
    """Lines of ``{sin, cos} @mbd.sincos<width>(x)`` and the declarations it needs (besides @sin and @cos).

    Parameters
    ----------
    width : number of angles, one of `WIDTHS`
    fused : whether the machine has a fused multiply-add instruction
    """
    w = _Lanes(width, fused)
    real, flag = w.real, w.flag
    w.lines.append(f"define internal fastcc {w.pair} @mbd.sincos{width}({real} %x) #1 {{\nentry:")
    size = w.do(f"call {real} @llvm.fabs.{w.suffix}({real} %x)")
    near = w.do(f"fcmp olt {real} {size}, {w.number(LIMIT)}")
    shifted = w.add(w.mul("%x", w.number(TWO_OVER_PI)), w.number(SHIFT))
    n, bits = w.sub(shifted, w.number(SHIFT)), w.do(f"bitcast {real} {shifted} to {w.bits}")
    first = w.sub("%x", w.mul(n, w.number(HALF_PI[0])))
    part = w.mul(n, w.number(HALF_PI[1]))
    second = w.sub(first, part)
    rest = w.mul(n, w.number(HALF_PI[2]))
    r = w.sub(second, rest)
    c = w.add(w.sub(part, w.sub(first, second)), w.sub(rest, w.sub(second, r)))
    z = w.mul(r, r)
    zz, half = w.mul(z, z), w.mul(z, w.number(0.5))
    top = w.sub(w.number(1.0), half)
    sine = w.sub(r, w.mad(w.mul(r, z), w.polynomial(SINE, z, zz), w.mul(c, top)))
    tail = w.mad(zz, w.polynomial(COSINE, z, zz), w.mul(r, c))
    cosine = w.add(top, w.add(w.sub(w.sub(w.number(1.0), top), half), tail))
    odd = w.do(f"trunc {w.bits} {bits} to {flag}")
    turned = w.do(f"add {w.bits} {bits}, {w.integer(1)}")
    s = w.negate_on_bit_one(w.choose(odd, cosine, sine), bits)
    k = w.negate_on_bit_one(w.choose(odd, sine, cosine), turned)
    every = near if width == 1 else w.do(f"call i1 @llvm.vector.reduce.and.v{width}i1({flag} {near})")
    w.lines.append(f"br i1 {every}, label %fast, label %far, !prof !0\nfast:")
    w.give(s, k)
    w.lines.append("far:")
    w.give(*(w.choose(near, polynomial, _library(w, name)) for polynomial, name in ((s, "sin"), (k, "cos"))))
    w.lines.append("}")
    needs = [f"declare {real} @llvm.fabs.{w.suffix}({real})"]
    if width > 1:
        needs.append(f"declare i1 @llvm.vector.reduce.and.v{width}i1({flag})")
    if fused:
        needs.append(f"declare {real} @llvm.fma.{w.suffix}({real}, {real}, {real})")
    return w.lines, needs


def _library(w: _Lanes, name: str) -> str:
    """The C library's value on every lane."""
    if w.width == 1:
        return w.do(f"call double @{name}(double %x) #2")
    result = "poison"
    for lane in range(w.width):
        x = w.do(f"extractelement {w.real} %x, i64 {lane}")
        value = w.do(f"call double @{name}(double {x}) #2")
        result = w.do(f"insertelement {w.real} {result}, double {value}, i64 {lane}")
    return result
