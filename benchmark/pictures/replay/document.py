"""Trajectories as a JSON document whose numbers are packed tightly.

What changes from step to step is rounded to fixed units, written as differences of neighbours in
as few bytes as they need (zigzag, seven bits a byte), and deflated: a tenth of what the numbers
would take as text. A page carries a document per episode, and unpacks it in the browser.
"""

import base64
import zlib
from typing import Any, Literal

import msgspec
import numpy as np
import numpy.typing as npt

from benchmark.pictures.replay.trajectories import (
    Collision,
    Ground,
    Ints,
    Silhouette,
    Trajectories,
    Vehicles,
)

NONE = -1  # in place of nan

UNITS = {  # what one stands for
    "x": 0.02,  # m
    "y": 0.02,  # m
    "angle": 360 / 1024,  # degrees
    "speed": 0.1,  # m/s
    "acceleration": 0.1,  # m/s2
    "average": 0.01,  # s
    "waiting": 0.1,  # s
    "movement_waiting": 0.1,  # s
}
EVEN = {"x", "y"}  # the second differences of even motion are zero


class Column(msgspec.Struct, frozen=True):
    """A column of the packed numbers."""

    name: str  # of the field, with the junction's index before it in ``0.average``
    count: int
    unit: float  # what 1 stands for
    order: Literal[1, 2]  # how often neighbours were subtracted


class Document(msgspec.Struct, frozen=True):
    """What a page carries of an episode."""

    format: Literal[1]
    title: str
    record: dict[str, Any]
    step: float
    start: float
    steps: int
    warm_up: float
    ground: Ground
    classes: list[Silhouette]
    vehicles: Vehicles
    states: list[list[str]]  # of each junction's lights
    collisions: list[Collision]
    columns: list[Column]
    data: str


def document(kept: Trajectories) -> Document:
    """Trajectories as they are kept."""
    parts: dict[str, npt.NDArray[Any]] = dict(vars(kept.tracks))
    for index, curves in enumerate(kept.curves):
        fields = {name: part for name, part in vars(curves).items() if name != "states"}
        parts |= {f"{index}.{name}": part for name, part in fields.items()}
    columns, packed = [], []
    for name, part in parts.items():
        field = name.rpartition(".")[2]
        column = Column(name, part.size, UNITS.get(field, 1), 2 if field in EVEN else 1)
        columns.append(column)
        packed.append(_pack(column, part.ravel()))
    return Document(
        format=1,
        title=kept.title,
        record=kept.record.model_copy(update={"wall_time": 0.0}).model_dump(
            mode="json", by_alias=True
        ),  # the same episode makes the same page
        step=kept.step,
        start=kept.start,
        steps=kept.steps,
        warm_up=kept.warm_up,
        ground=kept.ground,
        classes=kept.classes,
        vehicles=kept.vehicles,
        states=[curves.states for curves in kept.curves],
        collisions=kept.collisions,
        columns=columns,
        data=base64.b64encode(zlib.compress(b"".join(packed), 9, wbits=-15)).decode(),
    )


def _pack(column: Column, values: npt.NDArray[Any]) -> bytes:
    whole = np.rint(np.nan_to_num(values, nan=NONE * column.unit) / column.unit).astype(np.int64)
    for _ in range(column.order):
        whole = np.diff(whole, prepend=0)
    return encode(whole)


def encode(values: Ints) -> bytes:
    """Whole numbers in as few bytes as each needs: seven bits in each, the lowest first.

    The sign is the lowest bit (zigzag), as in Protocol Buffers.
    """
    rest = (values.astype(np.int64) << 1 ^ values.astype(np.int64) >> 63).astype(np.uint64)
    septets = []
    while True:
        septets.append(rest & np.uint64(127))
        rest = rest >> np.uint64(7)
        if not rest.any():
            break
    table = np.array(septets, dtype=np.uint8).reshape(len(septets), -1)
    length = len(septets) - np.argmax(table[::-1] > 0, axis=0)
    length[~table.any(axis=0)] = 1
    place = np.arange(len(septets))[:, None]
    table[place < length - 1] |= 128
    return bytes(table.T[(place < length).T])
