"""Arguments of a wrong kind: every word says which argument, what came, and what would be right."""

from __future__ import annotations

import inspect

import pytest

import mbd

MODEL = mbd.Model("arguments")
ROD = mbd.Link("rod", mass=1.0, length=1.0, center=0.5)
HINGE = mbd.Revolute("hinge", MODEL.ground.origin, ROD.start)
FRAMES = MODEL.ground.origin, ROD.end

WORDS = {
    **{scheme: () for scheme in (mbd.HHT, mbd.GeneralizedAlpha, mbd.Newmark)},
    **{scheme: () for scheme in (mbd.RadauIIA, mbd.RungeKutta4, mbd.RungeKutta853)},
    **{
        joint: ("joint", *FRAMES)
        for joint in (
            mbd.Cylindrical, mbd.Free, mbd.Planar, mbd.Prismatic, mbd.Revolute, mbd.Spherical, mbd.Translation,
            mbd.Universal, mbd.Weld,
        )
    },
    mbd.Screw: ("screw", *FRAMES, 0.1),
    mbd.PointMass: ("point", 1.0),
    mbd.RigidBody: ("body", 1.0, (1.0, 1.0, 1.0)),
    mbd.Link: ("link", 1.0, 1.0, 0.5),
    mbd.AffineFriction: (1.0, 0.1, 0.1),
    mbd.CompressibleDamper: (10.0, 5.0, 1e4),
    mbd.Coulomb: (1.0,),
    mbd.Dahl: (1.0, 100.0),
    mbd.Dissipation: (lambda rate: rate * rate,),
    mbd.LuGre: (1.2, 1.0, 0.1, 100.0),
    mbd.PinFriction: (0.1, 0.1),
    mbd.Quadratic: (1.0,),
    mbd.Stribeck: (0.6, 0.4, 0.1),
    mbd.Tabulated: ((-1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)),
    mbd.Valves: (mbd.Viscous(1.0), mbd.Viscous(1.0)),
    mbd.Viscous: (1.0,),
    mbd.Bushing: ("bushing", *FRAMES, 1.0),
    mbd.Applied: ("push", FRAMES[1], (1.0, 0.0, 0.0)),
    mbd.DCMotor: ("motor", HINGE, 1.0, 1.0, 1.0),
    mbd.Damper: ("damper", *FRAMES, 1.0),
    mbd.Motor: ("motor", HINGE, 1.0),
    mbd.Muscle: ("muscle", FRAMES, 600.0, 0.1, 0.2),
    mbd.PolynomialPath: (HINGE, {(0,): 0.3, (1,): -0.04}),
    mbd.ViaPoint: (ROD.end,),
    mbd.WrappingSphere: (ROD.end, 0.05),
    mbd.WrappingCylinder: (ROD.end, 0.05, "z"),
    mbd.WrappingEllipsoid: (ROD.end, (0.05, 0.04, 0.03)),
    mbd.Mode: ("phase", ("swing", "stance")),
    mbd.SampledLaw: ("PD", 0.01, {"u": lambda angle: -angle}, ("hinge.angle",)),
    mbd.Transition: ("swing", "stance", "foot"),
    mbd.mass_matrix: ("hinge",),
    mbd.bias_forces: ("hinge",),
    mbd.Potential: ("potential", lambda angle: angle, ("hinge.angle",)),
    mbd.Samples: ([0.0, 1.0], [0.0, 1.0]),
    mbd.Spring: ("spring", *FRAMES, 1.0),
    mbd.TabulatedSpring: ("spring", HINGE, (-1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)),
    mbd.Rotor: ("rotor", HINGE, 1e-3),
    mbd.TorsionSpring: ("spring", HINGE, 1.0),
    mbd.Bilateral: ("rail", mbd.flexion(HINGE)),
    mbd.Controller: ("brain", lambda time, values, state: None, 0.1),
    mbd.Event: ("event", mbd.flexion(HINGE)),
    mbd.Impulse: ("kick", HINGE, 1.0, "foot"),
    mbd.SpringLeg: ("leg", ROD.end, 1e4, 1.0, 1.2),
    mbd.HystereticStop: ("stop", mbd.flexion(HINGE), 1e3, 0.4, 0.01),
    mbd.MaxwellStop: ("stop", mbd.flexion(HINGE), 1e3, 1e3, 10.0),
    mbd.Bristles: (0.5, 1e4, 50.0),
    mbd.KnifeEdge: ("knife", ROD.end),
    mbd.Nonholonomic: ("row", lambda rate: rate, 0.0, ("hinge.rate",)),
    mbd.Penalty: ("stop", mbd.flexion(HINGE), 1e3),
    mbd.Ball: (ROD.end, 0.1),
    mbd.Plane: (),
    mbd.Rolling: ("wheel", ROD.end, 0.1),
    mbd.Unilateral: ("foot", mbd.height(ROD.end)),
    mbd.When: ("foot",),
    mbd.cone: (HINGE, 1.0),
    mbd.disk_touchdown: (ROD.end, 0.1, (0.0, 0.0, 1.0)),
    mbd.distance: FRAMES,
    mbd.twist: (HINGE, 1.0),
    mbd.extension: (HINGE,),
    mbd.flexion: (HINGE,),
    mbd.height: (ROD.end,),
    mbd.measure: ("hinge.angle",),
    mbd.penalty_parameters: (0.5, 1e-3, 1.0, 1.0),
    mbd.profile_touchdown: (ROD.end, ((-0.1, 0.1), (0.0, 0.0), (0.2, 0.1))),
    mbd.rolling_touchdown: (ROD.end, 0.1),
    mbd.sphere_touchdown: (ROD.end, 0.1),
    mbd.separation: (*FRAMES, (1.0, 0.0, 0.0)),
    mbd.touchdown: (ROD.end,),
    mbd.Coordinate: ("theta",),
    mbd.Lagrangian: ("pendulum", ("theta",), lambda theta_rate: 0.5 * theta_rate**2),
    mbd.Marker: ("ankle", ROD, (0.1, 0.2)),
    mbd.Model: ("model",),
    mbd.on_slope: (0.1,),
    mbd.human: (70.0, 1.75),
    mbd.latin_hypercube: ({"rod.mass": (1.0, 2.0)}, 4),
    mbd.sobol: ({"rod.mass": (1.0, 2.0)}, 4),
}  # fmt: skip
"""Each word with arguments that make one, of which every one is exchanged for wrong ones."""

BESIDE = {
    "made by others, not by users": (
        mbd.Accuracy, mbd.Basin, mbd.Batch, mbd.Criteria, mbd.Effects, mbd.Failure, mbd.Fit, mbd.GaitReport, mbd.Known,
        mbd.LimitCycle, mbd.Linearization, mbd.Mobility, mbd.PenaltyParameters, mbd.Replay, mbd.Sensitivities,
        mbd.State, mbd.StateSpace, mbd.Sweep, mbd.Trajectory, mbd.Branch, mbd.PointCurve, mbd.GaitSearch,
        mbd.Optimum, mbd.InverseDynamics, mbd.PlateRecord, mbd.Recording,
        mbd.InverseKinematics, mbd.ImportedModel, mbd.ImportReport, mbd.MuscleForces, mbd.NormativeBand,
    ),
    "take a model and a run: tests of their own": (
        mbd.accuracy, mbd.assemble, mbd.basin, mbd.batch, mbd.criteria, mbd.effects, mbd.fit, mbd.gait_report,
        mbd.limit_cycle, mbd.linearize,
        mbd.load, mbd.mobility, mbd.project, mbd.replay, mbd.sensitivities, mbd.simulate, mbd.sweep,
        mbd.branch, mbd.find_gait, mbd.optimize, mbd.inverse_dynamics, mbd.read,
        mbd.film, mbd.inverse_kinematics, mbd.muscle_forces, mbd.read_band,
        mbd.assign_plates, mbd.ForcePlate, mbd.scale, mbd.read_model, mbd.write_model, mbd.margin_of_stability,
    ),
    "of numbers and traced values": (
        mbd.acos, mbd.asin, mbd.atan, mbd.atan2, mbd.clip, mbd.cos, mbd.cosh, mbd.exp, mbd.floor, mbd.hypot, mbd.log,
        mbd.maximum, mbd.minimum, mbd.mod, mbd.sign, mbd.sin, mbd.sinh, mbd.sqrt, mbd.tan, mbd.tanh, mbd.where,
    ),
    "persons, shapes of mass, domains: tests/parts, tests/bodies": (
        mbd.Human, mbd.Domain, mbd.box, mbd.cylinder, mbd.disk, mbd.rod, mbd.segment, mbd.sphere,
    ),
}  # fmt: skip
"""Public names that are not tried here, by the reason."""

WRONG = [
    "x", "", None, [1], {}, {1: 2}, {"a": 1}, ["a"], (None, None, None), (1, 2, 3, 4), [[1]], object(), -1.0,
    float("nan"), float("inf"), 1j, b"x", True, lambda: 0, mbd.PointMass,
]  # fmt: skip


def test_every_public_name_is_tried_or_said_why_not():
    known = {*WORDS, *(each for group in BESIDE.values() for each in group)}
    for name in mbd.__all__:
        public = getattr(mbd, name)
        if callable(public) and not (inspect.isclass(public) and issubclass(public, Exception)):
            assert public in known, (
                f"mbd.{name} is new: give it a line in WORDS of tests/test_arguments.py, mbd.{name}: (arguments that "
                "make one,), so that wrong arguments are tried; or in BESIDE, under the reason why not"
            )


@pytest.mark.parametrize("word", WORDS, ids=lambda word: word.__name__)
def test_a_wrong_argument_is_taken_or_told_in_words(word):
    signature = inspect.signature(word)
    for name, parameter in signature.parameters.items():
        for wrong in WRONG:
            bound = signature.bind(*WORDS[word])
            bound.arguments[name] = (wrong,) if parameter.kind is parameter.VAR_POSITIONAL else wrong
            try:
                made = word(*bound.args, **bound.kwargs)
            except mbd.MbdError:
                continue  # told in words; anything else that it raises is a fault
            assert repr(made)
            assert isinstance(made, mbd.Model | mbd.Lagrangian) or isinstance(hash(made), int)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: mbd.HHT(alpha="x"), "alpha between 0 and 1/3, not 'x'; 0.05 is common"),
        (lambda: mbd.GeneralizedAlpha(rho_inf=None), "rho_inf between 0 and 1, not None; 0.9 is common"),
        (lambda: mbd.Newmark(gamma="x"), "gamma='x'"),
        (lambda: mbd.RadauIIA(tolerance="x"), "tolerance must be a number between 0 and 1e-3, not 'x'"),
        (lambda: mbd.HHT(formulation=""), "formulation is 'ggl' or 'index3', not ''"),
        (lambda: mbd.Controller("brain", print, reads=5, period=1.0), "reads of Controller 'brain' must be a name"),
        (lambda: mbd.Event("end", mbd.flexion(HINGE), terminal="no"), "terminal of Event 'end' must be True or False"),
        (lambda: mbd.Translation("slide", *FRAMES, stiffness=1.0), "would act on several coordinates"),
        (lambda: mbd.Dissipation(5), "needs D"),
        (lambda: mbd.Motor("m", HINGE, 1.0, arguments=5), "arguments must be a list"),
        (
            lambda: mbd.Lagrangian("p", 5, 0.0, parameters={"m": "x"}),
            "the value of 'm' must be a finite number, not 'x'",
        ),
    ],
)
def test_the_sentence_names_the_argument_and_what_came(make, said):
    with pytest.raises(mbd.ModelError, match=said):
        make()


def test_lists_of_names_are_introduced_by_what_has_them():
    for call, said in (
        (lambda: mbd.assemble(MODEL, backend="lvm"), "There are 'auto', 'llvm', 'python'"),
        (lambda: mbd.assemble(MODEL, parameters={"rod.mas": 1.0}), "There are "),
        (lambda: mbd.assemble(MODEL, position={"zzz": 1.0}), "; the model has 'hinge.angle'"),
        (lambda: mbd.assemble(MODEL, position={"hinge.rate": 1.0}), "give it in velocity="),
        (lambda: mbd.assemble(MODEL, velocity={"rod.end.x": 1.0}), "no rate named 'rod.end.x'"),
    ):
        if not MODEL.joints:
            MODEL.connect(HINGE)
        with pytest.raises(mbd.ModelError, match=said):
            call()
