"""Runs with known motions, made by hand: what results, plots and pages are tested on."""

from collections.abc import Sequence

import numpy as np

from mbd.equations.equations import Contact, Coordinate, Effect, Equations, Parameter, Row
from mbd.errors import UnknownNameError, nearest
from mbd.results.trajectory import EventRecord, Record, Trajectory
from mbd.state import Mode, State
from mbd.tape.derivatives import jvp
from mbd.tape.functions import cos, sin
from mbd.tape.node import Node, Scalar, Tape


class Sheet:
    """A tape with the inputs of n coordinates, and named outputs."""

    def __init__(self, n: int) -> None:
        self.tape = tape = Tape()
        self.t = tape.input("t")
        self.q = [tape.input("q", k) + tape.input("x", k) for k in range(n)]
        self.v = [tape.input("v", k) for k in range(n)]
        self.a = [tape.input("a", k) for k in range(n)]
        self.outputs: dict[str, Node] = {}

    def coordinates(self, *names: str) -> tuple[Coordinate, ...]:
        for k, name in enumerate(names):
            self.outputs |= {name: self.q[k], f"{name}.rate": self.v[k], f"{name}.acceleration": self.a[k]}
        return tuple(Coordinate(name, "rad" if name.endswith("angle") else "m") for name in names)

    def rate(self, value: Node) -> Node:
        return jvp([value], {self.tape.input("x", k): v for k, v in enumerate(self.v)})[0]

    def point(self, name: str, x: Scalar, y: Scalar) -> tuple[Node, Node]:
        x, y = self.tape.lift(x), self.tape.lift(y)
        self.outputs |= {f"{name}.x": x, f"{name}.y": y, f"{name}.z": self.tape.zero}
        self.outputs |= {f"{name}.vx": self.rate(x), f"{name}.vy": self.rate(y), f"{name}.vz": self.tape.zero}
        return x, y

    def output(self, name: str) -> Node:
        if name not in self.outputs:
            raise UnknownNameError(nearest(name, self.outputs, "result"))
        return self.outputs[name]

    def equations(
        self, name: str, coordinates: tuple[Coordinate, ...], kinetic: Node, potential: Node, *,
        rows: Sequence[Row] = (), contacts: Sequence[Contact] = (), effects: Sequence[Effect] = (),
        parameters: Sequence[Parameter] = (), figure: Sequence[tuple[str, Sequence[str]]] = (),
    ) -> Equations:  # fmt: skip
        return Equations(
            name, self.tape, coordinates, (), tuple(parameters), (), tuple(rows), tuple(contacts), (), tuple(effects),
            kinetic, potential, None, self.output, lambda: tuple(self.outputs),
            tuple(f"{c.name}.rate" for c in coordinates), figure=lambda: list(figure),
        )  # fmt: skip


def record(equations: Equations, time, q, v, a, *, lam=None, closed=None, events=(), parameters=(), **more) -> Record:
    count = len(time)
    empty = np.zeros((count, 0))
    names = equations.velocity_names
    final = State(float(time[-1]), q[-1], v[-1], mode=Mode(frozenset({"floor"})), names=names)
    settings = {"integrator": "HHT(alpha=0.05)", "dt": 0.01, "versions": {"mbd": "0.1.0"}}
    return Record(
        equations, np.array([p.value for p in equations.parameters], dtype=float),
        tuple(p.name for p in equations.parameters), time, q, v, empty, a, empty,
        np.zeros((count, len(equations.rows))) if lam is None else lam,
        np.zeros((count, len(equations.contacts)), dtype=np.uint8) if closed is None else closed,
        events, {"steps": count - 1, "wall_time": 0.25},
        **({"success": True, "message": "reached the end", "final": final, "settings": settings} | more),
    )  # fmt: skip


def oscillator(dt: float = 0.01, until: float = 2.0, damping: float = 0.3, stiffness: float = 9.0) -> Trajectory:
    """A mass of 1 kg on a spring with a damper and a force cos 2t: x = e^(−δt) cos ωt + p cos 2t + r sin 2t, exact."""
    sheet = Sheet(1)
    coordinates = sheet.coordinates("slider.displacement")
    sheet.outputs["slider.rate"] = sheet.v[0]
    sheet.outputs["spring.force"] = stiffness * sheet.q[0]
    sheet.point("mass.origin", sheet.q[0], 0.0)
    push = cos(2.0 * sheet.t)
    effects = (
        Effect("damper", "loss", list, power=-damping * sheet.v[0] ** 2),
        Effect("push", "applied", list, power=push * sheet.v[0]),
    )
    equations = sheet.equations(
        "oscillator", coordinates, 0.5 * sheet.v[0] ** 2, 0.5 * stiffness * sheet.q[0] ** 2, effects=effects,
        figure=[("mass", ["origin"])],
    )  # fmt: skip
    t = np.linspace(0.0, until, round(until / dt) + 1)
    q, v, a = oscillation(t, damping, stiffness)
    return Trajectory(record(equations, t, q[:, None], v[:, None], a[:, None]))


def oscillation(t: np.ndarray, damping: float = 0.3, stiffness: float = 9.0) -> tuple[np.ndarray, ...]:
    """x, ẋ, ẍ of `oscillator`."""
    decay, force = damping / 2.0, 1.0 / (stiffness - 4.0 + 2j * damping)
    omega = np.sqrt(stiffness - decay**2)
    free, driven = np.exp((-decay + 1j * omega) * t), force * np.exp(2j * t)
    return tuple((free * (-decay + 1j * omega) ** k + driven * (2j) ** k).real for k in range(3))


def ball(restitution: float = 0.8, bounces: int = 4, dt: float = 0.01, slope: float = 0.0) -> Trajectory:
    """A ball of 2 kg that falls 1 m onto a floor and bounces; then it drops to its rest at the last touch."""
    mass, g = 2.0, 10.0
    gx, gy = g * float(np.sin(slope)), -g * float(np.cos(slope))
    sheet = Sheet(2)
    coordinates = sheet.coordinates("flight.x", "flight.y")
    x, y = sheet.point("ball.origin", *sheet.q)
    sheet.outputs |= {"floor.gap": y, "floor.force": -sheet.tape.input("lam", 0)}
    anchor = [sheet.tape.input("anchor", k) for k in range(2)]
    rows = (Row("floor", "normal", y, sheet.v[1], 0), Row("floor", "tangent", x - anchor[0], sheet.v[0], 0))
    contact = Contact("floor", "unilateral", y, sheet.v[1], (0, 1), (x, y), (0, 1))
    equations = sheet.equations(
        "ball", coordinates, 0.5 * mass * (sheet.v[0] ** 2 + sheet.v[1] ** 2), -mass * (gx * x + gy * y),
        rows=rows, contacts=(contact,), figure=[("ball", ["origin"])],
        parameters=[Parameter("ball.mass", mass), Parameter("gravity.x", gx), Parameter("gravity.y", gy)],
    )  # fmt: skip
    pieces, events, start, speed = [], [], 0.0, 0.0
    height, x0, vx = 1.0, 0.0, 0.5
    for k in range(bounces + 1):
        flight = (speed + np.sqrt(speed**2 - 2.0 * gy * height)) / -gy
        s = np.linspace(0.0, flight, max(3, round(flight / dt)))
        pieces.append(
            (start + s, x0 + vx * s + gx * s**2 / 2, height + speed * s + gy * s**2 / 2, vx + gx * s, speed + gy * s)
        )
        start, x0, vx = start + flight, x0 + vx * flight + gx * flight**2 / 2, vx + gx * flight
        down = -(speed + gy * flight)
        after = restitution * down if k < bounces else 0.0
        row = sum(len(piece[0]) for piece in pieces)
        loss = 0.5 * mass * (down**2 - after**2) + (0.0 if k < bounces else 0.5 * mass * vx**2)
        impulse = np.array([mass * (down + after)])
        events.append(EventRecord(start, "closed", "floor", impulse, loss, row))
        if k < bounces:
            events.append(EventRecord(start, "opened", "floor", row=row))
        speed, height = after, 0.0
    s = np.linspace(0.0, 0.2, 21)
    pieces.append((start + s, x0 + 0 * s, 0 * s, 0 * s, 0 * s))
    t, qx, qy, ux, uy = (np.concatenate([piece[k] for piece in pieces]) for k in range(5))
    resting = np.arange(len(t)) >= len(t) - len(s)
    q, v = np.column_stack([qx, qy]), np.column_stack([ux, uy])
    a = np.where(resting[:, None], 0.0, [gx, gy])
    lam = np.where(resting[:, None], [mass * gy, mass * gx], 0.0)
    closed = resting.astype(np.uint8)[:, None]
    return Trajectory(record(equations, t, q, v, a, lam=lam, closed=closed, events=events))


def walker(
    steps: int = 5, period: float = 0.5, swing: float = 0.25, dt: float = 0.01, slope: float = 0.05
) -> Trajectory:
    """Two straight legs of 1 m that pivot in turn about their feet, angles ±swing·cos: a motion, not a dynamics."""
    sheet = Sheet(4)
    tape = sheet.tape
    coordinates = sheet.coordinates("trunk.x", "trunk.y", "left hip.angle", "right hip.angle")
    hip = sheet.point("hip.origin", *sheet.q[:2])
    rows, contacts, figure = [], [], [("hip", ["origin"])]
    for number, side in enumerate(("left", "right")):
        angle = sheet.q[2 + number]
        sheet.point(f"{side} leg.start", *hip)
        x, y = sheet.point(f"{side} leg.end", hip[0] + sin(angle), hip[1] - cos(angle))
        places = (2 * number, 2 * number + 1)
        name = f"{side} foot"
        rows += [
            Row(name, "normal", y, sheet.rate(y), number),
            Row(name, "tangent", x - tape.input("anchor", places[0]), sheet.rate(x), number),
        ]
        contacts.append(Contact(name, "unilateral", y, sheet.rate(y), (2 * number, 2 * number + 1), (x, y), places))
        sheet.outputs |= {f"{name}.gap": y, f"{name}.force": -tape.input("lam", 2 * number)}
        figure.append((f"{side} leg", ["start", "end"]))
    gx, gy = 9.81 * float(np.sin(slope)), -9.81 * float(np.cos(slope))
    parameters = [Parameter("hip.mass", 10.0), Parameter("gravity.x", gx), Parameter("gravity.y", gy)]
    kinetic = 5.0 * (sheet.v[0] ** 2 + sheet.v[1] ** 2)
    equations = sheet.equations(
        "walker", coordinates, kinetic, -10.0 * (gx * hip[0] + gy * hip[1]), rows=rows, contacts=contacts,
        figure=figure, parameters=parameters,
    )  # fmt: skip
    s = np.linspace(0.0, period, round(period / dt) + 1)
    u, times, q, v, closed, events, foot = np.pi / period, [], [], [], [], [], 0.0
    for step in range(steps):
        stance, angle, rate = step % 2, swing * np.cos(u * s), -swing * u * np.sin(u * s)
        columns = [foot - np.sin(angle), np.cos(angle), angle, -angle]
        rates = [-np.cos(angle) * rate, -np.sin(angle) * rate, rate, -rate]
        order = [0, 1, 2, 3] if stance == 0 else [0, 1, 3, 2]
        if step:
            side, other = ("left", "right") if stance == 0 else ("right", "left")
            row = step * len(s)
            events.append(EventRecord(step * period, "closed", f"{side} foot", np.array([1.0, 0.1]), 0.5, row))
            events.append(EventRecord(step * period, "opened", f"{other} foot", row=row))
        times.append(step * period + s)
        q.append(np.column_stack([columns[k] for k in order]))
        v.append(np.column_stack([rates[k] for k in order]))
        closed.append(np.tile(np.eye(2, dtype=np.uint8)[stance], (len(s), 1)))
        foot += 2.0 * np.sin(swing)
    held = np.concatenate(closed)
    lam = np.repeat(held, 2, axis=1) * -98.1 * np.array([1.0, 0.0, 1.0, 0.0])
    q_all = np.concatenate(q)
    run = record(
        equations,
        np.concatenate(times),
        q_all,
        np.concatenate(v),
        np.zeros_like(q_all),
        lam=lam,
        closed=held,
        events=events,
    )
    return Trajectory(run)
