"""Every public word, every argument of it, every kind of wrong value: the error names what was expected and what came.

Examples of right arguments are found by the names of parameters, so that a new word is tried without a line here.
"""

import inspect
import math
import re
import warnings
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import pytest

import mbd
from tests.view.handmade_runs import walker

MODEL = mbd.Model("arm")
UPPER = mbd.Link("upper", mass=1.0, length=1.0, center=0.5, inertia=0.1)
HINGE = mbd.Revolute("hinge", MODEL.ground.origin, UPPER.start)
MODEL.connect(HINGE)
START = mbd.assemble(MODEL, position={"hinge.angle": 0.3}, backend="python")
PLATE = mbd.PlateRecord.at("plate 1", [0.0, 0.1], [(0.0, 50.0, 0.0)] * 2, [(0.0, 0.0, 0.0)] * 2)
ORIGIN, END, ANGLE = MODEL.ground.origin, UPPER.end, mbd.flexion(HINGE)

KICK = {"pivot.angle.rate": 2.0}
SWING = mbd.Model("swing")
ROD = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=0.1)
SWING.connect(mbd.Revolute("pivot", SWING.ground.origin, ROD.start, loss=mbd.Viscous(0.1)))
SWING.constrain(mbd.Event("below", mbd.measure(lambda a: a, "pivot.angle", unit="rad"), direction=1, reset=KICK))

BENT = mbd.PolynomialPath((HINGE,), {(0,): 0.3, (1,): -0.05})
MUSCLE = mbd.Muscle("flexor", BENT, max_force=1000.0, fiber_length=0.1, tendon_length=0.2)

EXAMPLES: dict[str, Any] = {
    "a": ORIGIN,
    "anatomy": "left hip",
    "angle": (-1.0, 0.0, 1.0),
    "approach_speed": 1.0,
    "arguments": ("hinge.angle",),
    "b": END,
    "backward": mbd.Viscous(1.0),
    "body": UPPER,
    "body_mass": 70.0,
    "center": 0.5,
    "child": END,
    "coefficient": 1.0,
    "constant": 1.0,
    "coordinates": ("theta",),
    "count": 4,
    "direction": (1.0, 0.0, 0.0),
    "effective_mass": 1.0,
    "failure": "absent.npz",
    "fiber_length": 0.1,
    "form": "box",
    "forward": mbd.Viscous(1.0),
    "frame": END,
    "function": lambda x: x,
    "guard": ANGLE,
    "height": 1.75,
    "inertia": (1.0, 1.0, 1.0),
    "integrator": mbd.HHT(),
    "joint": HINGE,
    "joints": (HINGE,),
    "kinetic": lambda theta_rate: theta_rate**2,
    "length": 1.0,
    "limit": 1.0,
    "loss": 1.0,
    "mass": 1.0,
    "max_force": 1000.0,
    "measure": ANGLE,
    "model": MODEL,
    "motion": {"time": [0.0, 0.1, 0.2], "hinge.angle": [0.0, 0.1, 0.3]},
    "mu": 0.1,
    "name": "new",
    "other": "foot",
    "parent": ORIGIN,
    "path": "absent.npz",
    "penetration": 1e-3,
    "pitch": 0.1,
    "point": END,
    "radii": (0.1, 0.1, 0.1),
    "radius": 0.1,
    "ranges": {"upper.mass": (1.0, 2.0)},
    "rate": (-1.0, 0.0, 1.0),
    "resistance": 1.0,
    "restitution": 0.5,
    "row": lambda rate: rate,
    "sides": (1.0, 1.0, 1.0),
    "slope": 0.1,
    "smoothing": 0.1,
    "sole": ((-0.1, 0.1), (0.0, 0.0), (0.2, 0.1)),
    "start": START,
    "state": START,
    "starts": [START, START],
    "speed": 0.1,
    "at": "hinge.angle",
    "size": 1.0,
    "on": "foot",
    "share": 0.4,
    "hip": END,
    "touchdown_angle": 1.2,
    "travel": 0.01,
    "branch_stiffness": 1.0,
    "branch_damping": 1.0,
    "damping": 1.0,
    "static": 0.6,
    "stiffness": 1.0,
    "subject": ANGLE,
    "tendon_length": 0.2,
    "terms": {(1,): -0.05},
    "time": (0.0, 1.0, 2.0),
    "torque": 1.0,
    "until": 0.0,
    "states": ("swing", "stance"),
    "period": 0.1,
    "outputs": {"u": lambda angle: -angle},
    "source": "swing",
    "target": "stance",
    "update": lambda time, values, state: None,
    "values": (0.0, 1.0, 2.0),
    "voltage": 1.0,
    "viscous": 1.0,
    "quadratic": 1.0,
}
"""A right argument by the name of its parameter."""

OWN: dict[tuple[str, str], Any] = {
    ("Muscle", "path"): BENT, ("muscle_forces", "muscles"): (MUSCLE,),
    ("write_model", "path"): str(Path(mkdtemp()) / "arm.urdf"),
    ("SampledLaw", "arguments"): ("hinge.angle",), ("Transition", "on"): "foot",
    ("Mode", "transitions"): (
        mbd.Transition("swing", "stance", after=0.1), mbd.Transition("stance", "swing", after=0.1),
    ),
    ("Stribeck", "kinetic"): 0.4, ("LuGre", "kinetic"): 0.4, ("Rotor", "inertia"): 1e-3,
    ("Applied", "force"): (1.0, 0.0, 0.0), ("accuracy", "until"): 0.1, ("effects", "until"): 0.1,
    ("Controller", "period"): 0.1, ("Event", "direction"): 0,
    ("Event", "guard"): mbd.measure("hinge.angle"), ("Marker", "place"): (0.1, 0.2), ("Motor", "torque"): 1.0,
    ("Nonholonomic", "arguments"): ("hinge.rate",), ("Rolling", "center"): END,
    ("Tabulated", "torque"): (-1.0, 0.0, 1.0), ("TabulatedSpring", "torque"): (-1.0, 0.0, 1.0),
    ("rolling_touchdown", "center"): END, ("disk_touchdown", "center"): END,
    ("sphere_touchdown", "center"): END, ("Ball", "center"): END,
    ("disk_touchdown", "axis"): (0.0, 0.0, 1.0),
    ("scale", "person"): mbd.human(75.0, 1.8), ("scale", "lengths"): {"left thigh": 0.4},
    ("scale", "recording"): None,
    ("ForcePlate", "recording"): PLATE, ("ForcePlate", "during"): None, ("ForcePlate", "threshold"): 10.0,
    ("ForcePlate", "foot"): END, ("assign_plates", "recording"): mbd.Recording([0.0, 0.1], plates=(PLATE,)),
    ("assign_plates", "motion"): mbd.simulate(MODEL, START, dt=0.1, until=0.1, backend="python"),
    ("assign_plates", "feet"): [END], ("assign_plates", "threshold"): 20.0,
    ("inverse_kinematics", "recording"): mbd.Recording([0.0], {"mark": [(1.0, 0.0, 0.0)]}),
    ("inverse_kinematics", "markers"): {"mark": END}, ("inverse_kinematics", "weights"): {"mark": 1.0},
    ("inverse_kinematics", "coordinates"): {"hinge.angle": [0.1]}, ("inverse_kinematics", "cutoff"): None,
    ("gait_report", "run"): walker(steps=5),
    ("fit", "data"): {"time": [0.1, 0.2], "hinge.angle": [0.3, 0.2]}, ("fit", "dt"): 0.1,
    ("fit", "parameters"): {"upper.length": 1.2},
    ("optimize", "problem"): MODEL, ("optimize", "dt"): 0.1, ("optimize", "until"): 0.2, ("optimize", "start"): START,
    ("optimize", "minimize"): "hinge.angle", ("optimize", "parameters"): {"upper.length": 1.2},
    ("batch", "dt"): 0.1, ("effects", "dt"): 0.1,
    ("segment", "name"): "thigh", ("simulate", "dt"): 0.1, ("sweep", "dt"): 0.1,
    ("mass_matrix", "coordinates"): ("hinge",), ("bias_forces", "coordinates"): ("hinge",),
    ("sensitivities", "dt"): 0.1, ("sensitivities", "wrt"): ["hinge.angle"], ("sweep", "values"): {"upper.mass": [1.0]},
}  # fmt: skip
"""Where a word means something else by it."""

SWINGING = {"model": SWING, "section": "below", "longest": 3.0}
RIGHT_GAITS = {
    "limit_cycle": {**SWINGING, "start": mbd.assemble(SWING, position={"pivot.angle": 0.3}), "on_failure": "return"},
    "find_gait": {**SWINGING, "position": {"pivot.angle": (0.2, 0.4)}, "velocity": {}, "closed": (), "tries": 2},
}
RIGHT_GAITS["branch"] = {
    "gait": mbd.limit_cycle(**RIGHT_GAITS["limit_cycle"]), "parameter": "pivot loss.coefficient",
    "to": 0.11, "steps": 2,
}  # fmt: skip
RIGHT_GAITS["basin"] = {
    "model": SWING, "gait": RIGHT_GAITS["branch"]["gait"], "axes": {"pivot.angle.rate": [2.0, 2.1]}, "steps": 2,
}  # fmt: skip
OWN |= {(word, name): value for word, values in RIGHT_GAITS.items() for name, value in values.items()}

MEANT_OTHERWISE = {
    "Samples": ("periodic",),
    "Translation": ("rest",),
    "load": ("path",),
    "read": ("path", "up", "forward"),
    "read_model": ("path", "stops", "losses", "repair", "base"),
    "replay": ("dt", "integrator", "steps", "model", "trusted"),
}
"""Arguments that are right by themselves: the sentence is about the others."""

RESULTS = {
    "Accuracy", "Basin", "Batch", "Criteria", "Domain", "Effects", "Failure", "Fit", "GaitReport", "Known",
    "LimitCycle", "Linearization", "Mobility",
    "PenaltyParameters", "Replay", "Sensitivities", "State", "StateSpace", "Sweep", "Trajectory",
}  # fmt: skip
"""Values that are handed to users, who make none."""
RESULTS |= {"ImportReport", "ImportedModel", "InverseDynamics", "InverseKinematics", "PlateRecord", "Recording"}
RESULTS |= {"MuscleForces", "NormativeBand"}
RESULTS |= {"film", "margin_of_stability", "read_band"}  # of runs that stand, of files: tests/laboratory
RESULTS |= {"Branch", "GaitSearch", "Optimum", "PointCurve"}

STUDIES = {"accuracy", "criteria", "effects", "fit", "optimize", "sensitivities"}
"""Words whose runs take seconds: what is no number at all is tried."""
RESULTS |= {"Human"}
GAITS = {"basin", "find_gait", "limit_cycle"}
"""Words that make so many runs that they take machine code."""

NOTHING = [None, "", [], {}, object(), b"x", 1j, lambda: 0, mbd.PointMass, MODEL, np.array([1.0, math.nan])]
NUMBERS = [-1.0, 0.0, 90.0, 420.0, 1e300, 10**400, math.nan, math.inf, True]
TEXTS = ["1.0", "hinge.angel", "two\nlines", ["hinge.angle", "hinge.angle"], {"hinge.angel": 1.0}, (None, None, None)]
MANY = [(1.0, 2.0, 3.0, 4.0), [[1.0]], {"a": math.nan}, ["a"], {1: 2}]
WRONG = [*NOTHING, *NUMBERS, *TEXTS, *MANY]

WORDS = {
    name: word
    for name in mbd.__all__
    if callable(word := getattr(mbd, name))
    and name not in RESULTS
    and getattr(word, "__module__", "") != "mbd.tape.functions"
    and not (inspect.isclass(word) and issubclass(word, Exception))
}


def right(name: str) -> dict[str, Any]:
    """Arguments with which a word is content."""
    found = {}
    for each in inspect.signature(WORDS[name]).parameters.values():
        if (name, each.name) in OWN:
            found[each.name] = OWN[name, each.name]
        elif each.default is each.empty and each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD):
            assert each.name in EXAMPLES, f"mbd.{name}: give an example of {each.name!r} in EXAMPLES"
            found[each.name] = EXAMPLES[each.name]
    if (
        "model" in found
        and "backend" in inspect.signature(WORDS[name]).parameters
        and name not in {"simulate", "batch", *GAITS}
    ):  # whose runs are longer
        found["backend"] = "python"
    return found | ({"dt": 0.1} if (name, "dt") in OWN else {})


def called(word: Any, given: dict[str, Any]) -> Any:
    """What a word gives for arguments by their names; those without a name are a tuple."""
    bound = inspect.signature(word).bind_partial()
    bound.arguments |= given
    if any(each.kind is each.VAR_POSITIONAL for each in bound.signature.parameters.values()):
        bound.apply_defaults()
        return word(*bound.args, **bound.kwargs)
    return word(**given)


def shown(value: Any) -> str:
    try:
        return repr(value)
    except ValueError:
        return type(value).__name__


def tells(text: str, name: str, value: Any) -> bool:
    """Whether a sentence names the argument, or the value that came."""
    stems = (name[:5].replace("_", " "), name[:5])
    came = (shown(value)[:20], f"{value:g}" if isinstance(value, float) else shown(value), type(value).__name__)
    came += (getattr(value, "__name__", ""),)
    value = value.tolist() if isinstance(value, np.ndarray) else value
    inside = [shown(each) for each in value] if isinstance(value, list | tuple | dict) else []
    inside += ["nan"] * ("None" in inside)
    return any(part.lower() in text.lower() for part in (*stems, *came, *inside) if part)


@pytest.fixture(autouse=True)
def without_warnings(tmp_path, monkeypatch):
    """In a folder of its own, where files with odd names may be written."""
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mbd.MbdWarning)
        yield


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n == "basin" else n for n in WORDS])
def test_a_wrong_argument_is_taken_or_named(name):
    word, fine = WORDS[name], right(name)
    files = {"load", "read", "read_model", "replay"} & {name}
    if name not in STUDIES and not files:
        assert called(word, fine) is not None
    for parameter in inspect.signature(word).parameters.values():
        if parameter.kind is parameter.VAR_KEYWORD:
            continue
        if name in STUDIES and parameter.name == "progress":
            continue
        wrong = [value for value in NOTHING[1:] if value is not MODEL] if name in STUDIES else WRONG
        for value in wrong:
            said = ""
            given = (value,) if parameter.kind is parameter.VAR_POSITIONAL else value
            try:
                made = called(word, {**fine, parameter.name: given})
                if inspect.isclass(word):
                    assert repr(made)
                    assert isinstance(made, mbd.Model | mbd.Lagrangian) or isinstance(hash(made), int)
            except mbd.MbdError as error:
                said = str(error)
            except FileNotFoundError as error:
                said = str(error) if files else ""
                assert files
            if said and parameter.name not in MEANT_OTHERWISE.get(name, ()):
                assert tells(said, parameter.name, value), f"{name}({parameter.name}={shown(value)}): {said}"


RUN = mbd.simulate(MODEL, START, dt=0.1, until=0.3, backend="python")
SLOPES = mbd.sensitivities(
    MODEL, START, dt=0.1, until=0.2, wrt=["hinge.angle"], of=["hinge.rate", "hinge.angle"], backend="python"
)
FITTED = mbd.fit(
    MODEL, START, {"time": [0.1, 0.2, 0.3], "hinge.angle": RUN["hinge.angle"][1:]}, {"upper.length": 1.0}, dt=0.1,
    backend="python",
)  # fmt: skip
GAIT = RIGHT_GAITS["branch"]["gait"]
SEEN = mbd.Recording(np.arange(20) / 100.0, {"mark": np.ones((20, 3))}, {"angle": np.arange(20.0)})
METHODS: dict[str, tuple[Any, dict[str, Any]]] = {
    "run[…]": (lambda name: RUN[name], {"name": "hinge.angle"}),
    "run.at": (RUN.at, {"times": [0.1, 0.2], "side": "left"}),
    "run.save": (RUN.save, {"path": "run", "names": ["hinge.angle"]}),
    "run.to_csv": (RUN.to_csv, {"path": "run.csv", "names": ["hinge.angle"], "at": 0.1, "side": "before"}),
    "run.to_sto": (RUN.to_sto, {"path": "run.sto", "names": ["hinge.angle"], "at": 0.1, "degrees": True}),
    "run.to_dataframe": (RUN.to_dataframe, {"names": ["hinge.angle"], "at": 0.1, "side": "before"}),
    "energy[…]": (lambda name: RUN.energy[name], {"name": "kinetic"}),
    "energy.to_dataframe": (RUN.energy.to_dataframe, {"by": "kind"}),
    "state[…]": (lambda name: START[name], {"name": "hinge.angle"}),
    "slopes[…]": (lambda names: SLOPES[names], {"names": "hinge.rate"}),
    "slopes[…, …]": (lambda of, by: SLOPES[of, by], {"of": "hinge.rate", "by": "hinge.angle"}),
    "slopes.along": (SLOPES.along, {"change": {"hinge.angle": 0.1}}),
    "fit.interval": (FITTED.interval, {"name": "upper.length", "level": 0.9}),
    "gait.at": (GAIT.at, {"parameters": {"pivot loss.coefficient": 0.11}}),
    "gait.derivatives[…, …]": (
        lambda of, by: GAIT.derivatives[of, by],
        {"of": "period", "by": "pivot loss.coefficient"},
    ),
    "recording[…]": (lambda column: SEEN[column], {"column": "mark"}),
    "Recording": (mbd.Recording, {"time": [0.0], "markers": {"mark": [(1.0, 0.0, 0.0)]}, "channels": {"angle": [1.0]}}),
    "recording.between": (SEEN.between, {"first": 0.0, "last": 0.1}),
    "recording.smoothed": (SEEN.smoothed, {"cutoff": 6.0}),
    "recording.filled": (SEEN.filled, {"longest": 0.1}),
    "PlateRecord.at": (
        mbd.PlateRecord.at,
        {"name": "p", "time": [0.0], "force": [(0.0, 9.0, 0.0)], "center": [(0.0, 0.0, 0.0)], "free_moment": 0.0},
    ),
    "film": (mbd.film, {"run": RUN, "markers": {"end": END}, "rate": 10.0, "scatter": 0.0, "seed": 0}),
    "point": (UPPER.point, {"x": 0.1, "y": 0.2, "z": 0.0}),
    "point by name": (lambda name: mbd.PointMass("bob", 1.0).point(0.1, 0.2, name=name), {"name": "toe"}),
    "turned": (UPPER.end.turned, {"angle": 0.1, "axis": (0.0, 0.0, 1.0)}),
    "turned by name": (lambda name: mbd.PointMass("bob", 1.0).origin.turned(0.1, name=name), {"name": "sole"}),
    "without": (lambda names: MODEL.without(names), {"names": "hinge"}),
    "describe": (MODEL.describe, {"mobility": False}),
}
"""What is asked of values that are made, with arguments with which it is content."""


@pytest.mark.parametrize("name", METHODS)
def test_a_wrong_argument_of_what_a_value_can_do_is_taken_or_named(name):
    method, fine = METHODS[name]
    method(**fine)
    for key in fine:
        for value in [*WRONG, 1e-320, np.array(0.5), np.array([]), np.array(["a"]), Decimal("0.5"), Fraction(1, 3)]:
            said = ""
            try:
                method(**{**fine, key: value})
            except mbd.MbdError as error:
                said = str(error)
            except OSError:  # a name that no file of this system may have
                said = key if key == "path" else ""
                assert said
            outside = key in ("at", "times") and "is outside the run" in said
            assert not said or outside or tells(said, key, value), f"{name}({key}={shown(value)}): {said}"


def test_bodies_have_names_like_all_else():
    for bodies in MODEL.bodies, mbd.human(75.0, 1.8).bodies:
        with pytest.raises(mbd.ModelError, match=r"no body named 'uper'.*'(upper|head)'"):
            bodies["uper"]


def test_numbers_are_what_a_float_can_be_made_of():
    """Decimals, fractions and numbers of numpy do what the float does that they stand for."""
    for number in Decimal("0.2"), Fraction(1, 5), np.float64(0.2), np.array(0.2):
        run = mbd.simulate(MODEL, START, dt=number / 2, until=number, backend="python")
        assert run.time[-1] == 0.2
        law = mbd.SampledLaw("law", number, {"u": lambda q: q}, ["hinge.angle"], delay=number)
        assert law.period == law.delay == 0.2
    with pytest.raises(mbd.ModelError, match="is more than 1000 periods"):
        mbd.SampledLaw("law", 0.01, {"u": lambda q: q}, ["hinge.angle"], delay=1e300)


@pytest.mark.parametrize("name", WORDS)
def test_a_misspelt_argument_gets_the_nearest_and_all_there_are(name):
    word, fine = WORDS[name], right(name)
    signature = inspect.signature(word)
    named = [each.name for each in signature.parameters.values() if each.kind not in (2, 4) and len(each.name) > 3]
    open_ended = any(each.kind is each.VAR_KEYWORD for each in signature.parameters.values())
    if not named:
        return
    wrong = named[-1][:-1] + ("x" if named[-1][-1] != "x" else "y")
    if open_ended and name != "sweep":
        wrong = "untill"
    kind = mbd.MbdError if open_ended else TypeError
    given = {key: value for key, value in fine.items() if open_ended or key != named[-1]}
    with pytest.raises((kind, TypeError), match=re.escape(repr(wrong))) as told:
        word(**given, **{wrong: 1.0})
    if not open_ended:
        assert f"did you mean {named[-1]!r}?" in str(told.value) and f"it takes {name}(" in str(told.value)


@pytest.mark.parametrize("name", WORDS)
def test_a_missing_argument_and_one_too_many_are_named(name):
    word = WORDS[name]
    parameters = inspect.signature(word).parameters.values()
    needed = [each.name for each in parameters if each.default is each.empty and each.kind not in (2, 4)]
    if needed:
        with pytest.raises(TypeError, match=f"^{name} needs {needed[0]!r}.*it takes {name}\\("):
            word()
    if not any(each.kind is each.VAR_POSITIONAL for each in parameters):
        with pytest.raises(
            TypeError, match=rf"^{name} takes \d+ arguments? without a keyword, 40 came; it takes {name}\("
        ):
            word(*range(40))


def test_a_type_error_from_inside_is_left_alone():
    class Listed(mbd.HHT):
        def __init__(self):
            super().__init__(form=None, alpha=0.05, formulation="ggl"[7])

    with pytest.raises(IndexError):
        Listed()

    def mine(parameters):
        raise TypeError("my own fault")

    table = mbd.sweep(MODEL, {"upper.mass": [1.0]}, mine, dt=0.1, until=0.0, backend="python")
    assert "TypeError: my own fault" in table.messages[0]


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
        (lambda: mbd.Translation("slide", ORIGIN, END, stiffness=1.0), "would act on several coordinates"),
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
        (lambda: mbd.assemble(MODEL, parameters={"upper.mas": 1.0}), "There are "),
        (lambda: mbd.assemble(MODEL, position={"zzz": 1.0}), "; the model has 'hinge.angle'"),
        (lambda: mbd.assemble(MODEL, position={"hinge.rate": 1.0}), "give it in velocity="),
        (lambda: mbd.assemble(MODEL, velocity={"upper.end.x": 1.0}), "no rate named 'upper.end.x'"),
    ):
        with pytest.raises(mbd.ModelError, match=said):
            call()
