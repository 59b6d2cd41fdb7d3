"""Records as a table: a row for each junction of an episode, a column for each figure.

A million records are too many for an object each. What reads whole folders, such as the leaderboard
and a run that goes on, works on this table. An episode of several junctions has one row more, for
the whole network: figures of whole trips stand there, once.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from itertools import repeat
from operator import attrgetter
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, Union, get_args, get_origin

from pydantic import BaseModel

from benchmark.control.training import Training
from benchmark.plumbing.plain import UNSEEN, shown
from benchmark.records.measures import MEASURES
from benchmark.records.record import Record

if TYPE_CHECKING:
    import msgspec
    import polars

BATCH = 20_000  # rows that are objects at a time
NETWORK = ""  # the junction of rows of a whole network
FACTS = (
    *("scenario", "scenario_hash", "controller", "rate", "seed", "status", "reason"),
    *("rules", "arbitration", "controller_from", "identity", "wall_time"),
)
_OF_JUNCTIONS = [measure for measure in MEASURES if not measure.is_of_trips]
_OF_TRIPS = [measure for measure in MEASURES if measure.is_of_trips]
FIGURES = tuple(measure.key for measure in (*_OF_JUNCTIONS, *_OF_TRIPS))
_facts = attrgetter(*FACTS)
_junction_getters = [measure.getter for measure in _OF_JUNCTIONS]
_trip_getters = [measure.getter for measure in _OF_TRIPS]
_NO_JUNCTION, _NO_TRIPS = [None] * len(_OF_JUNCTIONS), [None] * len(_OF_TRIPS)


def table_schema() -> "dict[str, polars.DataType | type[polars.DataType]]":
    """The columns and their types.

    ``record`` counts records, oldest first; ``junction`` is null where an episode has no figures;
    ``is_trained_on`` says whether the controller was trained on this very episode.
    """
    import polars

    numbers = {"rate": polars.Float64, "seed": polars.Int64, "wall_time": polars.Float64}
    return {
        "record": polars.Int64,
        **{name: numbers.get(name, polars.String) for name in FACTS},
        "is_trained_on": polars.Boolean,
        "versions": polars.String,
        "refusals": polars.List(polars.String),
        "junction": polars.String,
        **dict.fromkeys(FIGURES, polars.Float64),
    }


def records_table(records: Iterable[Any]) -> "polars.DataFrame":
    """The table of records, oldest first.

    Args:
        records: ``Record``, or what ``record_decoder`` gives.
    """
    import polars

    parts = [polars.DataFrame(schema=table_schema())]
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
    table = polars.DataFrame(
        [
            _numbers(name, column)
            if kind == polars.Float64
            else polars.Series(name, column, dtype=kind)
            for (name, kind), column in zip(table_schema().items(), columns, strict=False)
        ]
    )
    return shown_table(table)


def shown_table(table: "polars.DataFrame") -> "polars.DataFrame":
    """A table whose texts hold nothing that steers a terminal or breaks a line."""
    import polars

    changed = [
        column.map_elements(_plain, return_dtype=polars.String)
        for column in table.iter_columns()
        if column.dtype == polars.String and column.str.contains(UNSEEN).any()
    ]
    refusals = table["refusals"]
    if refusals.explode(empty_as_null=True).str.contains(UNSEEN).any():
        lines = [line and [*map(_plain, line)] for line in refusals.to_list()]
        changed.append(polars.Series("refusals", lines, dtype=refusals.dtype))
    return table.with_columns(changed)


def _plain(text: str) -> str:
    return shown(" ".join(text.split("\n")))


def _numbers(name: str, values: Sequence[Any]) -> "polars.Series":
    """A series of floats, through numpy, which is ten times as fast."""
    import numpy as np
    import polars

    return polars.Series(name, np.array(values, dtype=np.float64)).fill_nan(None)


def join_tables(parts: "Iterable[polars.DataFrame]") -> "polars.DataFrame":
    """Tables one after the other, their records counted on."""
    import polars

    first, shifted = 0, [polars.DataFrame(schema=table_schema())]
    for part in parts:
        if len(part):
            shifted.append(part.with_columns(polars.col("record") + first))
            first = shifted[-1]["record"][-1] + 1
    return polars.concat(shifted)


def _rows(number: int, record: Any) -> Iterator[tuple[object, ...]]:
    junctions, trips = record.junctions, record.trips
    told = _is_trained_on(record), _versions(record), _refusals(record)
    head = (number, *_facts(record), *told)
    if not junctions or trips is None:
        yield (*head, None, *_NO_JUNCTION, *_NO_TRIPS)
        return
    of_trips = [get(trips) for get in _trip_getters]
    several = len(junctions) > 1
    for name, junction in junctions.items():
        of_junction = [get(junction) for get in _junction_getters]
        yield (*head, name, *of_junction, *(_NO_TRIPS if several else of_trips))
    if several:
        yield (*head, NETWORK, *_NO_JUNCTION, *of_trips)


def _is_trained_on(record: Any) -> bool:
    return any(
        Training.meets(traffic, record.scenario, record.seed) for traffic in record.trained_on or ()
    )


def _versions(record: Any) -> str:
    return f"Right of Way {record.versions.rightofway} with SUMO {record.versions.sumo}"


def _refusals(record: Any) -> list[str] | None:
    refusals = [words for junction in record.junctions.values() for words in junction.refusals]
    return refusals or None


@cache
def record_decoder() -> "msgspec.json.Decoder[Any]":
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
        return Union[tuple(NoneType if part is NoneType else _type(part) for part in parts)]  # noqa: UP007 - of types that are only known here
    if get_origin(annotation) in (dict, tuple):
        return get_origin(annotation)[tuple(part if part is ... else _type(part) for part in parts)]
    return annotation
