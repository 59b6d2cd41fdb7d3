"""What an episode leaves behind, with units; the schema of the store."""

from collections.abc import Iterable
from typing import Literal

from pydantic import Field

from benchmark.control.training import Training
from benchmark.plumbing.models import Entry, Words


class Waiting(Entry):
    """Stationary time in the control zone over a group of vehicles."""

    mean: float = Field(description="[s]")
    p95: float = Field(description="95th percentile [s]")
    maximum: float = Field(description="[s]")
    vehicles: int


class JunctionMetrics(Entry):
    """The figures of one intersection over the evaluation window."""

    average_waiting_time: float | None = Field(description="[s], the headline; paper's definition")
    wang_waiting_time: float | None = Field(description="[s], as Wang's code averages")
    waiting_time_per_vehicle: Waiting | None
    waiting_by_kind: dict[str, Waiting] = Field(description="by RV and HV")
    waiting_by_class: dict[str, Waiting]
    waiting_by_movement: dict[str, Waiting]
    throughput: float = Field(description="[veh/h] past the entrance")
    unregulated_lane_ratio: float
    unregulated_lane_curve: tuple[float, ...] = Field(
        description="mean over each ten seconds of the whole episode, warm-up included"
    )
    lane_changes: int = Field(description="in the control zone")
    go_held_back: int = Field(description="Go commands the arbitration held back, whole episode")
    refused_commands: int = Field(description="whole episode")
    refusals: tuple[Words, ...] = Field(description="the most frequent reasons")


class TripMetrics(Entry):
    """The figures of whole trips over the evaluation window."""

    time_loss: float | None = Field(description="[s], mean over vehicles on the road in the window")
    travel_time: float | None = Field(description="[s], mean over vehicles that arrived in it")
    insertion_delay: float | None = Field(
        description="[s], mean over vehicles that entered in it or were waiting to enter at the end"
    )
    never_inserted: int = Field(description="vehicles still waiting to enter at the end")
    arrived: int
    collisions: int = Field(description="unique pairs of vehicles")
    collisions_with_robot: int = Field(description="of these, pairs with an RV")
    emergency_brakings: int
    co2: float | None = Field(description="[g/km]")
    nox: float | None = Field(description="[mg/km]")
    fuel: float | None = Field(description="[g/km]")


class Versions(Entry):
    """What produced the record."""

    rightofway: str
    sumo: str
    python: str


class Record(Entry):
    """One episode: one scenario, controller, rate and seed."""

    schema_: Literal[1] = Field(1, alias="schema", description="version of this format")
    scenario: str
    controller: str
    rate: float | None = Field(
        description="penetration rate; null stands for every rate, as no vehicle is commanded"
    )
    seed: int
    status: Literal["ok", "failed", "crashed", "timed out", "skipped"]
    reason: Words | None = Field(None, description="why it is not ok")
    rules: Literal["signals", "robot vehicles"] | None = None
    arbitration: Literal["flexible", "own"] | None = None
    scenario_hash: str
    network_hash: str | None = None
    routes_hash: str | None = None
    controller_from: str | None = Field(
        None, description="distribution and version, or a file; SHA-256 but of Right of Way's own"
    )
    weights_hash: str | None = None
    trained_on: tuple[Training, ...] | None = Field(
        None, description="as the controller declares; null where it declares nothing"
    )
    identity: str | None = Field(
        None, description="SHA-256 of all that determines the figures; null in older records"
    )
    versions: Versions
    junctions: dict[str, JunctionMetrics] = Field(default_factory=dict)
    trips: TripMetrics | None = None
    wall_time: float = Field(0.0, description="[s]; the only field that differs between repeats")

    @property
    def episode(self) -> tuple[str, str, str, float | None, int]:
        """What tells episodes apart in a leaderboard: the newest record of each counts."""
        return self.scenario, self.scenario_hash, self.controller, self.rate, self.seed

    @property
    def is_failure(self) -> bool:
        """Whether the episode should have had figures and has none."""
        return self.status not in ("ok", "skipped")

    def line(self) -> str:
        """The record as a line of JSON."""
        return self.model_dump_json(by_alias=True) + "\n"

    @property
    def code_hash(self) -> str:
        """SHA-256 of its controller's code; empty for Right of Way's own, and in older records."""
        return code_hash(self.controller_from)


def code_hash(controller_from: str | None) -> str:
    """The SHA-256 in what says where a controller came from, empty without one."""
    return (controller_from or "").partition(" sha256:")[2]


def told_apart(records: Iterable[Record]) -> list[Record]:
    """Records in which a controller's name stands for one code: its hash is added where needed.

    The same code as it was before an edit, and another of the same name, are controllers of their
    own beside it.
    """
    chosen = list(records)
    versions: dict[str, set[str]] = {}
    for record in chosen:
        if record.code_hash:
            versions.setdefault(record.controller, set()).add(record.code_hash)
    return [
        record.model_copy(update={"controller": f"{record.controller} ({record.code_hash[:8]})"})
        if record.code_hash and len(versions[record.controller]) > 1
        else record
        for record in chosen
    ]
