"""What films show of vehicles and signal heads, as ``page/traffic.js`` does in pages.

Outlines are in metres: [to the right, ahead] of a vehicle's front bumper or a head's stop line.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmark.pictures.geometry import Points
from benchmark.pictures.replay.trajectories import Silhouette, Told

EVEN = 0.05  # m/s2, within which a Drive holds its speed
AHEAD = np.array([0.0, 1.4])  # m from a stop line to its heads

RV, HV, GLASS, BLACK, WHITE = "#e0352b", "#f5f5f1", "#141a1eb8", "#15191b", "#ffffff"
RINGS = {
    "go": "#4fd37f",
    "stop": "#ffb224",
    "held": "#c08bff",
    "faster": "#4cc9f0",
    "slower": "#ffb224",
    "even": "#9fb0b8",
}
GREEN, YELLOW, RED, DARK = "#3ddc74", "#ffd23f", "#ff5a4a", "#8a8f92"
AFTER_A_STOP = "#ffb224"  # right on red
LIGHTS = {"G": GREEN, "g": GREEN, "y": YELLOW, "u": YELLOW, "r": RED, "s": AFTER_A_STOP}

TURN = np.linspace(0, 2 * np.pi, 16, endpoint=False)
DISC = np.column_stack([np.sin(TURN), np.cos(TURN)])

Patch = tuple[Points, str]  # an outline and what fills it


class Decision(NamedTuple):
    """What an RV was told for the next step."""

    told: int  # Told
    acceleration: float  # m/s2, of a Drive
    side: int  # lane change of a Drive: 1 to the left, -1 to the right

    @property
    def name(self) -> str:
        """What was told, a Drive by the way it changes speed."""
        if self.told != Told.DRIVE:
            return Told(self.told).name.lower()
        if abs(self.acceleration) <= EVEN:
            return "even"
        return "faster" if self.acceleration > 0 else "slower"


def vehicle(kind: Silhouette, is_robot: bool, decision: Decision, pixel: float) -> Iterator[Patch]:
    """A vehicle with its windscreen; an RV that was told something has a ring and a sign.

    Args:
        kind: its size.
        is_robot: whether it is an RV.
        decision: what it was told.
        pixel: of the film [m], as what is smaller cannot be seen.
    """
    half, length = kind.width / 2, kind.length
    if decision.told:
        edge = max(0.3, 1.6 * pixel)
        yield _bar(half + edge, -length - edge, edge), RINGS[decision.name]
    corner = min(0.28 * kind.width, 0.12 * length)
    right = [(half - corner, 0.0), (half, -1.4 * corner)]
    right += [(half, corner - length), (half - corner, -length)]
    yield np.array(right + [(-x, y) for x, y in reversed(right)]), RV if is_robot else HV
    front, glass = -min(0.24 * length, 1.3), 0.39 * kind.width
    right = [(0.85 * glass, front), (glass, front - 0.65)]
    yield np.array(right + [(-x, y) for x, y in reversed(right)]), GLASS
    if decision.told:
        for shape in _on_roof(decision, kind, max(0.3 * kind.width, 2 * pixel)):
            yield shape, WHITE


def _on_roof(decision: Decision, kind: Silhouette, half: float) -> Iterator[Points]:
    """A decision's sign of a half width: arrow, bar, both, a beam ahead or back, arrow aside."""
    middle, name = -0.62 * kind.length, decision.name
    if name == "go":
        yield _arrow(half, middle - half, middle + half)
    elif name == "stop":
        yield _bar(half, middle - 0.4 * half, middle + 0.4 * half)
    elif name == "held":
        yield _arrow(half, middle - 1.5 * half, middle)
        yield _bar(half, middle + 0.4 * half, middle + half)
    elif name in ("faster", "slower"):
        reach = min(0.36 * kind.length, 0.3 + 0.5 * abs(decision.acceleration))
        yield _bar(0.4 * half, middle, middle + np.copysign(reach, decision.acceleration))
    if decision.side:
        foot = -np.sign(decision.side) * kind.width / 2
        tip = foot - np.sign(decision.side) * 1.6 * half
        yield np.array([(tip, middle), (foot, middle + 1.3 * half), (foot, middle - 1.3 * half)])


def head(letter: str, size: float) -> Iterator[Patch]:
    """A signal head: an arrow for green, a bar for red and a dot for yellow, on black."""
    yield 1.25 * size * DISC + AHEAD, BLACK
    if letter == "y":
        sign = 0.62 * size * DISC
    elif letter in "Ggs":
        sign = _arrow(0.85 * size, -0.7 * size, size)
    else:
        sign = _bar(size, -0.4 * size, 0.4 * size)
    yield sign + AHEAD, LIGHTS.get(letter, DARK)


def _arrow(half: float, low: float, high: float) -> Points:
    return np.array([(0.0, high), (half, low), (-half, low)])


def _bar(half: float, low: float, high: float) -> Points:
    return np.array([(half, high), (half, low), (-half, low), (-half, high)])
