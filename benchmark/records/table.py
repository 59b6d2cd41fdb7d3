"""Records as a table: a row for each junction of an episode, a column for each figure.

A million records are too many for an object each. What reads whole folders, such as the leaderboard
and a run that goes on, works on this table.
"""

import json
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from itertools import repeat
from operator import attrgetter
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, Union, get_args, get_origin

from pydantic import BaseModel

from benchmark.records.measures import COLUMNS
from benchmark.records.record import Record

if TYPE_CHECKING:
    import msgspec
    import polars

BATCH = 20_000  # rows that are objects at a time
FACTS = (
    *("scenario", "scenario_hash", "controller", "rate", "seed", "status", "reason"),
    *("rules", "arbitration", "controller_from", "identity", "wall_time"),
)
FIGURES = tuple(column.key for column in COLUMNS)
_facts = attrgetter(*FACTS)


def schema() -> "dict[str, polars.DataType | type[polars.DataType]]":
    """The columns and their types.

    ``record`` counts records, oldest first; ``junction`` is null where an episode has no figures.
    """
    import polars

    numbers = {"rate": polars.Float64, "seed": polars.Int64, "wall_time": polars.Float64}
    return {
        "record": polars.Int64,
        **{name: numbers.get(name, polars.String) for name in FACTS},
        "trained_on": polars.String,  # as JSON, like the next; null where there is none
        "refusals": polars.String,
        "junction": polars.String,
        **dict.fromkeys(FIGURES, polars.Float64),
    }


def of(records: Iterable[Any]) -> "polars.DataFrame":
    """The table of records, oldest first.

    Args:
        records: ``Record``, or what ``decoder`` gives.
    """
    import polars

    parts = [polars.DataFrame(schema=schema())]
    rows: list[tuple[object, ...]] = []
    for number, record in enumerate(records):
        rows += _rows(number, record)
        if len(rows) >= BATCH:
            parts.append(_table(rows))
            rows = []
    return polars.concat([*parts, _table(rows)])


def _table(rows: list[tuple[object, ...]]) -> "polars.DataFrame":
    import polars

    columns = zip(*rows, strict=True) if rows else repeat(())
    return polars.DataFrame(
        [
            _numbers(name, column)
            if kind == polars.Float64
            else polars.Series(name, column, dtype=kind)
            for (name, kind), column in zip(schema().items(), columns, strict=False)
        ]
    )


def _numbers(name: str, values: Sequence[Any]) -> "polars.Series":
    """A series of floats, through numpy, which is ten times as fast."""
    import numpy as np
    import polars

    return polars.Series(name, np.array(values, dtype=np.float64)).fill_nan(None)


def joined(parts: "Iterable[polars.DataFrame]") -> "polars.DataFrame":
    """Tables one after the other, their records counted on."""
    import polars

    first, shifted = 0, [polars.DataFrame(schema=schema())]
    for part in parts:
        if len(part):
            shifted.append(part.with_columns(polars.col("record") + first))
            first = shifted[-1]["record"][-1] + 1
    return polars.concat(shifted)


def _rows(number: int, record: Any) -> Iterator[tuple[object, ...]]:
    head = (number, *_facts(record), _training(record), _refusals(record))
    trips = record.trips
    if not record.junctions or trips is None:
        yield (*head, None, *(None,) * len(FIGURES))
        return
    for name, junction in record.junctions.items():
        yield (*head, name, *(column.get(junction, trips) for column in COLUMNS))


def _training(record: Any) -> str | None:
    if not record.trained_on:
        return None
    return json.dumps([(one.scenarios, one.first, one.last) for one in record.trained_on])


def _refusals(record: Any) -> str | None:
    found = [one for junction in record.junctions.values() for one in junction.refusals]
    return json.dumps(found) if found else None


@cache
def decoder() -> "msgspec.json.Decoder[Any]":
    """Reads lines of JSON as something with the attributes of a ``Record``, many times faster.

    It takes only what pydantic takes, as the types are the record's own.
    """
    import msgspec

    return msgspec.json.Decoder(_mirror(Record))


@cache
def _mirror(model: type[BaseModel]) -> Any:
    """A struct with the fields of a pydantic model."""
    import msgspec

    fields: list[Any] = [
        (name, _type(info.annotation))
        if info.is_required()
        else (name, _type(info.annotation), info.get_default())
        for name, info in model.model_fields.items()
    ]
    names = {name: info.alias for name, info in model.model_fields.items() if info.alias}
    return msgspec.defstruct(
        model.__name__, fields, rename=names, forbid_unknown_fields=True, kw_only=True, gc=False
    )


def _type(annotation: Any) -> Any:
    """An annotation with structs in place of models."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return _mirror(annotation)
    parts = get_args(annotation)
    if get_origin(annotation) in (Union, UnionType):
        return Union[tuple(NoneType if one is NoneType else _type(one) for one in parts)]  # noqa: UP007 - of types that are only known here
    if get_origin(annotation) in (dict, tuple):
        return get_origin(annotation)[tuple(one if one is ... else _type(one) for one in parts)]
    return annotation
