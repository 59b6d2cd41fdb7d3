"""Records by hand, and stores that hold them."""

import hashlib
import types
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hypothesis import strategies as st
from pydantic import BaseModel

from benchmark.records.record import JunctionMetrics, Record, TripMetrics, Versions, Waiting
from benchmark.records.store import Store

VERSIONS = Versions(rightofway="0.1.0", sumo="1.28.0", python="3.11.7")
SIGNAL = "traffic-light"
JUNCTION: dict[str, Any] = {
    "average_waiting_time": 20.0,
    "wang_waiting_time": 10.0,
    "waiting_time_per_vehicle": None,
    "throughput": 1000.0,
    "unregulated_lane_ratio": 0.25,
    "unregulated_lane_curve": (),
    "refusals": (),
}
JUNCTION |= {key: {} for key in ("waiting_by_kind", "waiting_by_class", "waiting_by_movement")}
JUNCTION |= dict.fromkeys(["lane_changes", "go_held_back", "refused_commands"], 0)
JUNCTION |= dict.fromkeys(["first_gridlock", "gridlock_exposure"])
TRIPS: dict[str, Any] = {"time_loss": 30.0, "travel_time": 60.0, "insertion_delay": 1.0}
TRIPS |= dict.fromkeys(["never_inserted", "arrived", "emergency_brakings"], 0)
TRIPS |= dict.fromkeys(["collisions", "collisions_with_robot"], 0)
TRIPS |= dict.fromkeys(["co2", "nox", "fuel"])


def junction(waiting: float | None = 20.0, **facts: Any) -> JunctionMetrics:
    return JunctionMetrics(**{**JUNCTION, "average_waiting_time": waiting, **facts})


def record(
    controller: str = "c",
    seed: int = 1,
    waiting: float | None = 20.0,
    rate: float | None = 0.5,
    junctions: Mapping[str, JunctionMetrics] | None = None,
    **facts: Any,
) -> Record:
    """An episode that is ok; figures by their names, other fields of the record too.

    A controller without a rate is ruled by signals.
    """
    figures = {key: facts.pop(key) for key in list(facts) if key in JUNCTION}
    trips = {**TRIPS, **{key: facts.pop(key) for key in list(facts) if key in TRIPS}}
    settled: dict[str, Any] = {"scenario": "test/a", "scenario_hash": "a" * 64, "status": "ok"}
    if (name := facts.get("scenario", "test/a")) != "test/a":
        settled["scenario_hash"] = hashlib.sha256(name.encode()).hexdigest()
    settled |= {"rules": "robot vehicles", "arbitration": "flexible"}
    if rate is None:
        settled |= {"rules": "signals", "arbitration": None}
    return Record(
        controller=controller,
        seed=seed,
        rate=rate,
        junctions=junctions or {"intersection": junction(waiting, **figures)},
        trips=TripMetrics(**trips),
        versions=VERSIONS,
        **{**settled, **facts},
    )


def unlucky(controller: str = "c", seed: int = 1, status: str = "failed", **facts: Any) -> Record:
    """An episode that is not ok; who crashed or timed out says nothing of its rules."""
    if status in ("crashed", "timed out"):
        facts |= {"rules": None, "arbitration": None}
    made = record(controller, seed, status=status, **facts)
    return made.model_copy(update={"junctions": {}, "trips": None})


def runs(waits: Sequence[float], **facts: Any) -> list[Record]:
    """Episodes with seeds from 1."""
    return [record(seed=seed, waiting=wait, **facts) for seed, wait in enumerate(waits, 1)]


def filled(folder: Path, *records: Record) -> Path:
    """A store with these records, which share a scenario; returns their file."""
    store = Store(folder)
    store.prepare()
    for one in records:
        store.append(one)
    (path,) = store.records_folder.iterdir()
    return path


def anything(annotation: Any) -> st.SearchStrategy[Any]:
    """Values of a field of the schema; numbers finite, texts arbitrary."""
    inner = typing.get_args(annotation)
    match typing.get_origin(annotation) or annotation:
        case typing.Literal:
            return st.sampled_from(inner)
        case typing.Annotated:
            return anything(inner[0])
        case typing.Union | types.UnionType:
            return st.one_of(*map(anything, inner))
        case builtin if builtin is dict:
            return st.dictionaries(anything(inner[0]), anything(inner[1]), max_size=2)
        case builtin if builtin is tuple:
            return st.lists(anything(inner[0]), max_size=3).map(tuple)
        case builtin if builtin is float:
            return st.floats(allow_nan=False, allow_infinity=False)
        case model if issubclass(model, BaseModel):
            fields = {f.alias or name: f.annotation for name, f in model.model_fields.items()}
            return st.builds(model, **{name: anything(kind) for name, kind in fields.items()})
        case other:
            return {
                int: st.integers(-(2**63), 2**63),
                str: st.text(max_size=9),
                type(None): st.none(),
            }[other]


SEEDS = range(1, 8)


def study(**waits: Sequence[float]) -> list[Record]:
    """Records of controllers by their waiting at 10, 20, ... %; the signal waits 20 s."""
    found = [record("traffic-light", seed, 20.0 + 0.1 * seed, rate=None) for seed in SEEDS]
    for name, means in waits.items():
        for index, mean in enumerate(means, start=1):
            found += [
                record(
                    name,
                    seed,
                    mean + 0.1 * seed,
                    rate=index / 10,
                    unregulated_lane_curve=(1.0, 0.5),
                    waiting_by_movement={
                        "N-C": Waiting(mean=mean, p95=mean, maximum=mean, vehicles=3)
                    },
                )
                for seed in SEEDS
            ]
    return found
