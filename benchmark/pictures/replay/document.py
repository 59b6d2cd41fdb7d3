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

from benchmark.pictures.replay import varints
from benchmark.pictures.replay.trajectories import (
    Collision,
    Curves,
    Floats,
    Ground,
    Ints,
    Natural,
    Tracks,
    Trajectories,
    VehicleClass,
    Vehicles,
)
from benchmark.records.record import Record

LARGEST_UNPACKED = 512 * 2**20  # bytes
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
WITH_GAPS = {"average", "waiting", "movement_waiting"}  # NONE stands for nan


class Column(msgspec.Struct, frozen=True):
    """A column of the packed numbers."""

    name: str  # of the field, with the junction's index before it in ``0.average``
    count: Natural
    unit: float  # what 1 stands for
    order: Literal[1, 2]  # how often neighbours were subtracted


class Document(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a page carries of an episode."""

    format: Literal[1]
    title: str
    record: dict[str, Any]
    step: float
    start: float
    steps: Natural
    warm_up: float
    ground: Ground
    classes: list[VehicleClass]
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
        data=base64.b64encode(_deflate(b"".join(packed))).decode(),
    )


def trajectories(found: Document) -> Trajectories:
    """What a document holds, with its numbers as they were rounded.

    Raises:
        ValueError: its parts do not fit each other.
    """
    columns = _unpack(found)
    samples, steps = sum(found.vehicles.steps), found.steps
    _expect(_consistent(found), "vehicles")
    tracks = Tracks(**{name: columns[name] for name in Tracks.__dataclass_fields__})
    _expect(all(part.shape == (samples,) for part in vars(tracks).values()), "tracks")
    _expect(len(found.states) == len(found.ground.junctions), "states")
    curves = [_curves(columns, index, states, steps) for index, states in enumerate(found.states)]
    return Trajectories(
        title=found.title,
        record=Record.model_validate_json(msgspec.json.encode(found.record)),
        step=found.step,
        start=found.start,
        steps=steps,
        warm_up=found.warm_up,
        ground=found.ground,
        classes=found.classes,
        vehicles=found.vehicles,
        tracks=tracks,
        curves=curves,
        collisions=found.collisions,
    )


def _consistent(found: Document) -> bool:
    """Whether the lists of vehicles and collisions fit each other."""
    who, count = found.vehicles, len(found.vehicles.id)
    lists = (who.kind, who.robot, who.movement, who.first, who.steps)
    return (
        found.step > 0
        and all(len(one) == count for one in lists)
        and all(kind < len(found.classes) for kind in who.kind)
        and all(
            steps > 0 and first + steps <= found.steps
            for first, steps in zip(who.first, who.steps, strict=True)
        )
        and all(vehicle < count for one in found.collisions for vehicle in one.vehicles)
    )


def _curves(
    columns: dict[str, npt.NDArray[Any]], index: int, states: list[str], steps: int
) -> Curves:
    names = [name for name in Curves.__dataclass_fields__ if name != "states"]
    parts = {name: columns[f"{index}.{name}"] for name in names}
    for name in ("movement_waiting", "movement_vehicles", "unregulated"):
        parts[name] = parts[name].reshape(-1, steps)
    for name in ("average", "waiting", "passed"):
        _expect(parts[name].shape == (steps,), name)
    light = parts["light"]
    _expect(light.size == (steps if states else 0), "light")
    _expect(not states or (light.min() >= 0 and light.max() < len(states)), "light")
    return Curves(states=states, **parts)


def _expect(fits: bool, what: str) -> None:
    if not fits:
        raise ValueError(f"its {what} do not fit the rest")


# --- numbers as bytes ------------------------------------------------------------------------


def _pack(column: Column, values: npt.NDArray[Any]) -> bytes:
    whole = np.rint(np.nan_to_num(values, nan=NONE * column.unit) / column.unit).astype(np.int64)
    for _ in range(column.order):
        whole = np.diff(whole, prepend=0)
    return varints.encode(whole)


def _unpack(found: Document) -> dict[str, npt.NDArray[Any]]:
    numbers = varints.decode(_inflate(base64.b64decode(found.data, validate=True)))
    ends = np.cumsum([column.count for column in found.columns], dtype=np.int64)
    _expect(len(ends) > 0 and len(numbers) == ends[-1], "columns")
    parts = np.split(numbers, ends[:-1])
    return {one.name: _values(one, part) for one, part in zip(found.columns, parts, strict=True)}


def _values(column: Column, whole: Ints) -> Floats | Ints:
    for _ in range(column.order):
        whole = np.cumsum(whole)
    field = column.name.rpartition(".")[2]
    if field not in UNITS:
        return whole
    values = (whole * column.unit).astype(np.float64)
    if field in WITH_GAPS:
        values[whole == NONE] = np.nan
    return values


def _deflate(data: bytes) -> bytes:
    squeeze = zlib.compressobj(9, zlib.DEFLATED, -15)
    return squeeze.compress(data) + squeeze.flush()


def _inflate(data: bytes) -> bytes:
    stretch = zlib.decompressobj(-15)
    found = stretch.decompress(data, LARGEST_UNPACKED)
    _expect(stretch.eof, "bytes")
    return found
