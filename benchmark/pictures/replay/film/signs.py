"""What is drawn on vehicles and heads, in a vehicle's own metres: [to the right, ahead].

The shapes and colours are those of the page (``benchmark/pictures/replay/page/traffic.js``).
"""

from collections.abc import Iterator

import numpy as np

from benchmark.pictures.geometry import Points
from benchmark.pictures.replay.film.pen import Colour
from benchmark.pictures.replay.trajectories import Told, VehicleClass

EVEN = 0.05  # m/s2, within which a Drive holds its speed
RINGS: dict[str, Colour] = {
    "go": (79, 211, 127),
    "stop": (255, 178, 36),
    "held": (192, 139, 255),
    "faster": (76, 201, 240),
    "slower": (255, 178, 36),
    "even": (159, 176, 184),
}
GREEN, YELLOW, RED = (61, 220, 116), (255, 210, 63), (255, 90, 74)
LIGHTS: dict[str, Colour] = {
    "G": GREEN,
    "g": GREEN,
    "y": YELLOW,
    "u": YELLOW,
    "r": RED,
    "s": (255, 178, 36),  # right on red, after a stop
}
DARK: Colour = (138, 143, 146)


def spoken(told: int, acceleration: float) -> str:
    """What an RV was told, a Drive by the way it changes speed."""
    if told != Told.DRIVE:
        return Told(told).name.lower()
    if abs(acceleration) <= EVEN:
        return "even"
    return "faster" if acceleration > 0 else "slower"


def body(kind: VehicleClass) -> Points:
    """A vehicle's outline; its front bumper's middle is the origin."""
    half, length = kind.width / 2, kind.length
    corner = min(0.28 * kind.width, 0.12 * length)
    right = [
        (half - corner, 0.0),
        (half, -1.4 * corner),
        (half, corner - length),
        (half - corner, -length),
    ]
    return np.array(right + [(-x, y) for x, y in reversed(right)])


def glass(kind: VehicleClass) -> Points:
    """Its windscreen, which shows the way it looks."""
    front, half = -min(0.24 * kind.length, 1.3), 0.39 * kind.width
    return np.array(
        [(0.85 * half, front), (half, front - 0.65), (-half, front - 0.65), (-0.85 * half, front)]
    )


def ring(kind: VehicleClass) -> Points:
    """What is drawn around an RV that was told something."""
    half, length = kind.width / 2 + 0.15, kind.length
    return np.array([(half, 0.15), (half, -length - 0.15), (-half, -length - 0.15), (-half, 0.15)])


def on_roof(
    what: str, acceleration: float, side: int, kind: VehicleClass, least: float
) -> Iterator[Points]:
    """The sign of a decision: an arrow, a bar, both, a beam ahead or back, an arrow aside.

    Args:
        what: as ``spoken`` has it.
        acceleration: of a Drive [m/s2].
        side: its change of lanes: 1 to the left, -1 to the right.
        kind: the vehicle's class.
        least: half the width of the smallest sign that can be seen [m].
    """
    middle, half = -0.62 * kind.length, max(0.3 * kind.width, least)
    if what == "go":
        yield _arrow(half, middle - half, middle + half)
    elif what == "stop":
        yield _bar(half, middle - 0.4 * half, middle + 0.4 * half)
    elif what == "held":
        yield _arrow(half, middle - 1.5 * half, middle)
        yield _bar(half, middle + 0.4 * half, middle + half)
    elif what in ("faster", "slower"):
        reach = min(0.36 * kind.length, 0.3 + 0.5 * abs(acceleration))
        yield _bar(0.4 * half, middle, middle + (reach if acceleration > 0 else -reach))
    if side:
        outward = -1.0 if side > 0 else 1.0
        tip, foot = outward * (kind.width / 2 + 1.6 * half), outward * kind.width / 2
        yield np.array([(tip, middle), (foot, middle + 1.3 * half), (foot, middle - 1.3 * half)])


def head(letter: str, size: float) -> Points | None:
    """A light's shape, an arrow for green and a bar for red; None for yellow, which is a dot."""
    if letter == "y":
        return None
    if letter in "Ggs":
        return np.array([(0.0, size), (0.85 * size, -0.7 * size), (-0.85 * size, -0.7 * size)])
    return _bar(size, -0.4 * size, 0.4 * size)


def _arrow(half: float, low: float, high: float) -> Points:
    return np.array([(0.0, high), (half, low), (-half, low)])


def _bar(half: float, low: float, high: float) -> Points:
    return np.array([(half, high), (half, low), (-half, low), (-half, high)])
