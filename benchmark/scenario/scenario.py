"""What a scenario is: one TOML file in, a validated model and a content hash out. No SUMO here."""

import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import date, time
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import (
    ConfigDict,
    Field,
    PrivateAttr,
    ValidationError,
    field_validator,
    model_validator,
)

from benchmark.plumbing import toml_file
from benchmark.plumbing.errors import ScenarioError
from benchmark.plumbing.messages import explain
from benchmark.plumbing.models import Table
from benchmark.scenario.demand import LARGEST_COUNT, Demand
from benchmark.scenario.evaluation import Evaluation, Zones
from benchmark.scenario.layout import COMPASS, LETTERS, TURNS, Approaches, ways_cross
from benchmark.scenario.signal import Signal
from benchmark.scenario.vehicles import VehicleClass

CENTRE = "intersection"
"""The id of a drawn scenario's junction."""


@dataclass(frozen=True)
class Ruled:
    """What a scenario says of one junction that controllers rule."""

    zones: Zones
    signal: Signal | None


class Scenario(Table):
    """One scenario: an intersection, its traffic, its signal and how it is evaluated."""

    model_config = ConfigDict(title="Right of Way scenario")

    schema_: Literal[1] = Field(alias="schema", description="Version of this format.")
    title: str = Field(min_length=1, max_length=200)
    tags: tuple[str, ...] = ()
    sources: tuple[str, ...] = Field((), description="Where geometry, counts and signal are from.")
    evaluation: Evaluation = Evaluation()
    intersection: Zones = Zones()
    approaches: Approaches
    demand: tuple[Demand, ...] = Field(min_length=1)
    vehicles: dict[str, VehicleClass] = Field(
        {"car": VehicleClass(share=1.0)}, min_length=1, description="Vehicle classes by name."
    )
    signal: Signal | None = None

    _name: str = PrivateAttr("")
    _path: Path | None = PrivateAttr(None)

    @property
    def name(self) -> str:
        """The name in tables: the file's folder and stem, as in ``colorado-springs/229``."""
        return self._name

    @property
    def path(self) -> Path | None:
        """The file that it was read from, as it was given; None if it was read from none."""
        return self._path

    def __eq__(self, other: object) -> bool:
        """Whether they say the same under the same name, wherever they were read from."""
        if not isinstance(other, Scenario):
            return NotImplemented
        return self.name == other.name and self.model_dump() == other.model_dump()

    @property
    def hash(self) -> str:
        """SHA-256 of what determines an episode; prose, place, rates and seeds are left out."""
        meaning = self.model_dump(
            mode="json",
            exclude={
                "title": True,
                "tags": True,
                "sources": True,
                "evaluation": {"penetration_rates", "seeds"},
                "intersection": {
                    "latitude",
                    "longitude",
                    *(() if self.intersection.priority else ("priority",)),
                    *(() if self.intersection.radius else ("radius",)),
                    *(() if self.intersection.driving_side == "left" else ("driving_side",)),
                },
                "signal": {"maximum_gap"} if self.signal and self.signal.kind == "fixed" else set(),
            },
        )
        for name, approach in self.approaches.items():
            meaning["approaches"][name] |= {
                "bay": approach.bay if approach.has_bay else None,
                "upstream_lanes": approach.upstream_lanes or len(approach.lane_turns),
                "exit_lanes": self.approaches.lanes_beyond(name)
                if approach.exit_lanes is None
                else approach.exit_lanes,
            }
            # at their defaults, as in files that are older than the keys
            if approach.right_on_red:
                del meaning["approaches"][name]["right_on_red"]
            if approach.heavy_vehicles is None:
                del meaning["approaches"][name]["heavy_vehicles"]
        for period in meaning["demand"]:
            if period["peak_hour_factor"] == 1:
                del period["peak_hour_factor"]
            for name in COMPASS:
                if period[name]["u_turn"] == 0:
                    del period[name]["u_turn"]
        canonical = json.dumps(meaning, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(canonical.encode()).hexdigest()

    def with_demand(self, factor: float) -> "Scenario":
        """The same scenario with every turning count multiplied."""
        if factor == 1:
            return self
        demand = tuple(period.scaled(factor) for period in self.demand)
        return self.model_copy(update={"demand": demand})

    @property
    def junctions(self) -> Mapping[str, Ruled]:
        """The junctions that controllers rule, by their ids."""
        return {CENTRE: Ruled(self.intersection, self.signal)}

    @property
    def programs(self) -> Mapping[str, Signal]:
        """The signal programs as deployed, by junction; only of those that have one."""
        return {name: ruled.signal for name, ruled in self.junctions.items() if ruled.signal}

    @property
    def heavy_share(self) -> float:
        """The share of trucks and buses among the vehicle classes."""
        return sum(each.share for each in self.vehicles.values() if each.is_heavy)

    def class_shares(self, approach: str) -> dict[str, float]:
        """The share of each vehicle class among the vehicles that arrive on an approach."""
        asked, heavy = self.approaches.of(approach).heavy_vehicles, self.heavy_share
        if asked is None:
            return {name: each.share for name, each in self.vehicles.items()}
        factors = {True: asked / heavy if heavy else 0.0, False: (1 - asked) / (1 - heavy or 1.0)}
        return {name: each.share * factors[each.is_heavy] for name, each in self.vehicles.items()}

    @property
    def peak(self) -> Demand:
        """The period with the greatest counts."""
        return max(self.demand, key=lambda period: period.total)

    @property
    def peak_demand(self) -> float:
        """All turning counts of the busiest period together [veh/h]."""
        return self.peak.total

    def at_demand(self, total: float) -> "Scenario":
        """The same scenario with its counts scaled to a total in the busiest period [veh/h].

        Its name says so, as in ``colorado-springs/334@700``.

        Raises:
            ScenarioError: a turn's count would be over what a scenario file may say.
        """
        try:
            scaled = self.with_demand(total / self.peak_demand)
        except ValidationError as error:
            raise ScenarioError(
                f"{self.name}@{total:g}: a turn would have more vehicles than a count may be, "
                f"{LARGEST_COUNT} veh/h; ask for fewer"
            ) from error
        copy = scaled.model_copy()
        copy._name = f"{self.name}@{total:g}"
        return copy

    def with_programs(self, programs: Mapping[str, Signal]) -> "Scenario":
        """The same scenario with other signal programs, by junction."""
        return self.model_copy(update={"signal": programs.get(CENTRE, self.signal)})

    def with_radius(self, radius: float) -> "Scenario":
        """The same scenario with a wider or narrower box [m]."""
        zones = self.intersection.model_copy(update={"radius": radius})
        return self.model_copy(update={"intersection": zones})

    def with_evaluation(self, evaluation: Evaluation) -> "Scenario":
        """The same scenario, evaluated otherwise."""
        return self.model_copy(update={"evaluation": evaluation})

    @field_validator("demand")
    @classmethod
    def _periods_in_order(cls, periods: tuple[Demand, ...]) -> tuple[Demand, ...]:
        ordered = tuple(sorted(periods, key=lambda period: period.begin))
        for earlier, later in pairwise(ordered):
            if later.begin < earlier.end:
                raise ValueError(
                    f"periods overlap: one ends at {earlier.end:g} s, "
                    f"the next begins at {later.begin:g} s"
                )
        return ordered

    @field_validator("vehicles")
    @classmethod
    def _shares_add_up(cls, classes: dict[str, VehicleClass]) -> dict[str, VehicleClass]:
        if bad := [name for name in classes if not re.fullmatch(r"[A-Za-z][\w-]*", name)]:
            raise ValueError(f'class name "{bad[0]}" must be letters, digits, - and _')
        total = sum(vehicle.share for vehicle in classes.values())
        if abs(total - 1) > 1e-6:
            raise ValueError(f"shares add up to {total:g}; expected 1")
        return dict(sorted(classes.items()))

    @model_validator(mode="after")
    def _lanes_match_counts(self) -> Self:
        problems = chain(
            self._side_problems(),
            self._road_problems(),
            self._heavy_problems(),
            self._priority_problems(),
            self._signal_problems(),
        )
        for problem in problems:
            raise ValueError(problem)
        return self

    def _side_problems(self) -> Iterator[str]:
        side = self.intersection.driving_side
        for name, approach in self.approaches.items():
            if not approach.in_order(side):
                yield (
                    f"approaches.{name}.lanes: {ways_cross(approach.lanes, side)} "
                    f'(intersection.driving_side is "{side}")'
                )

    def _road_problems(self) -> Iterator[str]:
        for name in COMPASS:
            counted = {t for t in TURNS if any(p.counts(name).of(t) > 0 for p in self.demand)}
            if name in self.approaches.names():
                yield from self._approach_problems(name, counted)
            elif counted:
                yield f"demand.{name}: there is no such approach; remove the counts"
        zones = self.intersection
        if not any(m[-1] in ("C", zones.crossing_turn) for m in self.approaches.movements()):
            yield f"approaches: all lanes turn {zones.driving_side}; there is nothing to regulate"

    def _approach_problems(self, name: str, counted: set[str]) -> Iterator[str]:
        approach, served = self.approaches.of(name), self.approaches.served_turns(name)
        for turn in sorted(counted - served):
            yield (
                f"demand.{name}: vehicles turn {turn} but no lane serves it in "
                f'approaches.{name}.lanes = "{approach.lanes}"; add a lane or drop the count'
            )
        for turn in sorted(served - counted):
            yield (
                f'approaches.{name}.lanes: "{approach.lanes}" serves {turn} but no turn '
                f"count uses it; remove the letter or add the count to demand"
            )
        if approach.exit_lanes and self.approaches.exit_leg(name, "C") is None:
            yield f"approaches.{name}.exit_lanes: there is no road beyond; remove the key"
        for turn in sorted(served):
            if self.approaches.exit_leg(name, turn) is None:
                yield f'approaches.{name}.lanes: turn "{turn}" leads to no road'

    def _heavy_problems(self) -> Iterator[str]:
        share = self.heavy_share
        for name, approach in self.approaches.items():
            asked = approach.heavy_vehicles
            if asked is not None and (asked > 0 >= share or asked < 1 <= share):
                kind = 'kind = "truck" or "bus"' if share <= 0 else "another kind"
                yield (
                    f"approaches.{name}.heavy_vehicles: {asked:g}, but no vehicle class has "
                    f"{kind} and a share; add one to vehicles"
                )

    def _priority_problems(self) -> Iterator[str]:
        names, priority = self.approaches.names(), self.intersection.priority
        for name in priority:
            if name not in names:
                yield (
                    f'intersection.priority: there is no approach "{name}"; '
                    f"expected some of {', '.join(names)}"
                )
        if set(priority) >= set(names):
            yield (
                "intersection.priority: names every approach, so nobody would stop; "
                "leave out those that stop"
            )

    def _signal_problems(self) -> Iterator[str]:
        if self.signal is None:
            return
        movements, kerb_turn = self.approaches.movements(), self.intersection.kerb_turn
        for index, phase in enumerate(self.signal.phases):
            for movement in phase.movements:
                if movement not in movements:
                    yield (
                        f'signal.phases[{index}]: unknown movement "{movement}"; '
                        f"expected one of {', '.join(movements)}"
                    )
        green = {movement for phase in self.signal.phases for movement in phase.movements}
        for movement in movements:
            if movement not in green and not movement.endswith(kerb_turn):
                yield f'signal.phases: movement "{movement}" is never green; add it to a phase'
        for name, approach in self.approaches.items():
            own = {movement for movement in green if movement.startswith(f"{LETTERS[name]}-")}
            turn = f"{LETTERS[name]}-{kerb_turn}"
            if turn in movements and not (own or approach.right_on_red or approach.slip_lane):
                yield f'signal.phases: movement "{turn}" is never green; add it to a phase'


def load_scenario(path: Path) -> Scenario:
    """Read and validate a scenario file.

    Raises:
        ScenarioError: the file is missing, not UTF-8, not TOML, or not a valid scenario; the
            message names the file, the key's path, the value, what was expected.
    """
    document = toml_file.read(path, ScenarioError)
    scenario = parse_scenario(
        document, source=str(path), name=f"{path.resolve().parent.name}/{path.stem}"
    )
    scenario._path = path
    return scenario


def parse_scenario(document: dict[str, Any], source: str, name: str) -> Scenario:
    """Validate a parsed TOML document.

    Args:
        document: the tables of the file.
        source: the file's name, for errors.
        name: the scenario's name in tables.

    Raises:
        ScenarioError: as ``load``.
    """
    if found := next(_not_json(document), None):
        raise ScenarioError(f"{source}: {found}")
    try:
        scenario = Scenario.model_validate_json(json.dumps(document))
    except ValidationError as error:
        raise ScenarioError(explain(error, Scenario, source)) from error
    scenario._name = name
    return scenario


DEEPEST = 20  # tables and lists within each other; a scenario needs six


def _not_json(value: object, path: str = "", depth: int = 0) -> Iterator[str]:
    """What JSON, and so a scenario, cannot hold: dates, and nesting without end."""
    if depth > DEEPEST:
        yield f"{path.partition('.')[0].partition('[')[0]}: tables or lists nested too deeply"
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from _not_json(inner, f"{path}.{key}".lstrip("."), depth + 1)
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _not_json(inner, f"{path}[{index}]", depth + 1)
    elif isinstance(value, date | time):
        yield f"{path}: got {value}, a date or time; no key takes one, so put texts in quotes"


def json_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of scenario files, for editors."""
    schema = Scenario.model_json_schema(by_alias=True)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
