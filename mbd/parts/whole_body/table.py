"""Segments of men and women, of a table of measured persons."""

from typing import NamedTuple

SEXES = ("male", "female")

HEIGHTS = {"male": 1.741, "female": 1.735}
"""Mean height of the persons measured [m]: 100 men of 73.0 kg and 15 women of 61.9 kg."""


class Row(NamedTuple):
    """A segment between two landmarks.

    mass : over that of the body; center : from the first landmark, over the length; sagittal, transverse, long : radii
    of gyration about the axis forward, the axis sideways and the axis along the segment, over the length; length : of
    the persons measured [m]
    """

    mass: float
    center: float
    sagittal: float
    transverse: float
    long: float
    length: float


DE_LEVA: dict[str, dict[str, Row]] = {
    "male": {
        "head": Row(0.0694, 0.5002, 0.303, 0.315, 0.261, 0.2429),
        "upper trunk": Row(0.1596, 0.2999, 0.716, 0.454, 0.659, 0.1707),
        "middle trunk": Row(0.1633, 0.4502, 0.482, 0.383, 0.468, 0.2155),
        "lower trunk": Row(0.1117, 0.6115, 0.615, 0.551, 0.587, 0.1457),
        "upper arm": Row(0.0271, 0.5772, 0.285, 0.269, 0.158, 0.2817),
        "forearm": Row(0.0162, 0.4574, 0.276, 0.265, 0.121, 0.2689),
        "hand": Row(0.0061, 0.3624, 0.288, 0.235, 0.184, 0.1879),
        "thigh": Row(0.1416, 0.4095, 0.329, 0.329, 0.149, 0.4222),
        "shank": Row(0.0433, 0.4459, 0.255, 0.249, 0.103, 0.4340),
        "foot": Row(0.0137, 0.4415, 0.257, 0.245, 0.124, 0.2581),
    },
    "female": {
        "head": Row(0.0668, 0.4841, 0.271, 0.295, 0.261, 0.2437),
        "upper trunk": Row(0.1545, 0.2077, 0.746, 0.502, 0.718, 0.1425),
        "middle trunk": Row(0.1465, 0.4512, 0.433, 0.354, 0.415, 0.2053),
        "lower trunk": Row(0.1247, 0.4920, 0.433, 0.402, 0.444, 0.1815),
        "upper arm": Row(0.0255, 0.5754, 0.278, 0.260, 0.148, 0.2751),
        "forearm": Row(0.0138, 0.4559, 0.261, 0.257, 0.094, 0.2643),
        "hand": Row(0.0056, 0.3427, 0.244, 0.208, 0.154, 0.1701),
        "thigh": Row(0.1478, 0.3612, 0.369, 0.364, 0.162, 0.3685),
        "shank": Row(0.0481, 0.4416, 0.271, 0.267, 0.093, 0.4323),
        "foot": Row(0.0129, 0.4014, 0.299, 0.279, 0.139, 0.2283),
    },
}
"""P. de Leva, Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters, J. Biomechanics 29 (1996) 1223, table
4.

Head from the vertex to the seventh cervical vertebra; upper, middle and lower trunk from the suprasternal notch to the
xiphoid process, to the navel, to the middle of the hip joints; upper arm, forearm from shoulder to elbow to wrist
joint; hand from there to the tip of the third finger; thigh, shank from hip to knee joint to the lateral malleolus;
foot from heel to toe, with its long axis forward.
"""

SHOULDERS = {"male": 0.5155, "female": 0.4979}
"""From the middle of the hip joints to the middle of the shoulder joints (the same table) [m]."""
