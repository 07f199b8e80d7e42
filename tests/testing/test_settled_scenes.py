"""Scenes that a judge once called bad, each for another reason, keep the laws; those in space may end by name."""

import pytest

from tests.fuzz.verdict import verdict

SETTLED = {
    2002301: "friction that turns and loads a disk as it comes to rest",
    2002333: "a ball that grips while friction turns",
    2002173: "dense output of a step that takes one direction of friction",
    2002237: "a disk that falls flat",
    2002243: "a twist next to half a turn",
    2003276: "parts of a step that end before a foot comes to rest",
    2010461: "friction as sliding begins",
    2010515: "a spring at a stop of twist next to half a turn",
    2010525: "a disk on springs that passes flat",
    2010788: "dense output of steps of nanoseconds",
    2020892: "a run that goes on after a row was found to depend on others",
    2031315: "a stop of twist whose terms excused residuals as large as its forces",
    2011901: "what nearly rests and turns around",
}


LONG = 2010515
"""Four seconds, and with `-m slow` only."""


@pytest.mark.parametrize("number", [pytest.param(n, marks=[pytest.mark.slow] * (n == LONG)) for n in SETTLED])
def test_settled_scenes_stay_settled(number):
    told = verdict(number)
    assert told["kind"] != "bad", told["reasons"]


DRIVEN = {
    10006949: "a block on a table slips where its limit is reached, though multipliers lag",
    10011109: "a block on a table at which index 3 found no end of a step",
    10022587: "a foot that rises from a hill, comes down and rises again within one step",
    10022922: "a start from rest about a hinge that lies in the frame of its link",
    10027540: "balanced wheels at whose knot of a table nothing acts",
}


@pytest.mark.parametrize("number", DRIVEN)
def test_driven_scenes_stay_settled(number):
    told = verdict(number)
    assert told["kind"] == "ok", told
