"""Who may reserve windows: no two on one stretch may come too close in time."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from baselines.time_windows.prediction import PASSED, Windows
from baselines.time_windows.stretches import Numbers

Index = npt.NDArray[np.intp] | int


class Margins(NamedTuple):
    """Time kept between two vehicles on one stretch."""

    after: float  # s, to enter behind the end of a reserved window
    before: float  # s, to leave ahead of the start of a reserved window
    growth: float  # s for each second of look-ahead by which a window widens at both ends
    look_ahead: float  # s, from which it widens no further
    yielding: float  # s, an HV that arrives this much later stops for who is inside by then


class Ledger:
    """The windows of all vehicles that count now, and which of them are reserved or booked.

    Sets of vehicles are integers: bit v stands for vehicle v.

    Args:
        windows: of the vehicles.
        margins: between any two of their windows on one stretch.
    """

    def __init__(self, windows: Windows, margins: Margins) -> None:
        self._margins = margins
        widened = margins.growth * np.clip(windows.leave, 0.0, margins.look_ahead)
        hastened = margins.growth * np.clip(windows.enter, 0.0, margins.look_ahead)
        # of the row's vehicle, on the stretch that it shares with the column's vehicle
        enter = (windows.enter - hastened)[:, windows.ways]
        leave = (windows.leave + widened)[:, windows.ways]
        self._behind = enter - leave.T  # s by which the row's enters after the column's has left
        self._ahead = enter.T - leave  # s by which it leaves before the column's enters
        self._arrival = windows.arrival
        self._yields_from = np.where(windows.yields, windows.arrival - margins.yielding, PASSED)
        everybody = np.arange(len(windows.ways))
        self._clashes = _bits(self._clash(everybody[:, None], everybody[None, :]))
        self._meeting = _bits(~np.isnan(enter))
        self._reserved = self._barred = 0
        self._bookings: list[tuple[int, float]] = []

    def _clash(
        self, passing: Index, other: Index, delay: Numbers | float = 0.0
    ) -> npt.NDArray[np.bool_]:
        """Whether ``passing``, ``delay`` later, comes too close to ``other``.

        Arrays broadcast. Where ways never meet, times are NaN and compare false.
        """
        first = self._arrival[passing] + delay <= self._yields_from[other]
        return np.asarray(
            (self._behind[passing, other] + delay < self._margins.after)
            & (self._ahead[passing, other] - delay < self._margins.before)
            & ~first,
            dtype=np.bool_,
        )

    def reserve(self, vehicles: int) -> None:
        """Reserve the windows of vehicles, whatever they clash with."""
        self._reserved |= vehicles

    def free(self, vehicle: int) -> bool:
        """Whether a vehicle's windows keep their margins to all that is reserved or booked."""
        return not (self.in_the_way(vehicle) or self._barred >> vehicle & 1)

    def in_the_way(self, vehicle: int) -> int:
        """The vehicles whose reserved windows its own come too close to."""
        return self._clashes[vehicle] & self._reserved

    def book(self, vehicle: int, delays: Sequence[float]) -> float | None:
        """Book the first later slot in which a vehicle's windows are free.

        Args:
            vehicle: it.
            delays: the slots, by how much later than now possible [s], rising.

        Returns:
            The delay of the slot; None if none is free.
        """
        others = [*members(self._reserved & self._meeting[vehicle])]
        later = [0.0] * len(others)
        for other, delay in self._bookings:
            others.append(other)
            later.append(delay)
        relative = np.asarray(delays)[:, None] - np.array(later)
        clashes = self._clash(vehicle, np.array(others, dtype=np.intp), relative)
        for delay, taken in zip(delays, np.any(clashes, axis=1).tolist(), strict=True):
            if not taken:
                self._bookings.append((vehicle, delay))
                everybody = np.arange(len(self._arrival))
                (barred,) = _bits(self._clash(everybody, vehicle, -delay)[None])
                self._barred |= barred
                return delay
        return None

    def clear_the_way(self, vehicle: int) -> None:
        """Bar everybody whose way meets a vehicle's."""
        self._barred |= self._meeting[vehicle]


def _bits(rows: npt.NDArray[np.bool_]) -> list[int]:
    """Each row of truth values as an integer."""
    packed = np.packbits(rows, axis=1, bitorder="little")
    return [int.from_bytes(row.tobytes(), "little") for row in packed]


def members(bits: int) -> Iterator[int]:
    """The vehicles of a set."""
    while bits:
        lowest = bits & -bits
        yield lowest.bit_length() - 1
        bits ^= lowest
