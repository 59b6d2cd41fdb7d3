"""What an episode leaves behind, with units; the schema of the store.

`benchmark.records.measures` says what each figure is.
"""

from typing import Literal

from pydantic import Field

from benchmark.control.training import Training
from benchmark.plumbing.models import Entry, Words


class Waiting(Entry):
    """Stationary time in the control zone over a group of vehicles."""

    mean: float = Field(description="[s]")
    p95: float = Field(description="95th percentile [s]")
    maximum: float = Field(description="[s]")
    vehicles: int = Field(description="[veh]")


class JunctionMetrics(Entry):
    """The figures of one intersection over the evaluation window."""

    average_waiting_time: float | None = Field(description="[s]")
    wang_waiting_time: float | None = Field(description="[s]")
    waiting_time_per_vehicle: Waiting | None
    waiting_by_kind: dict[str, Waiting] = Field(description="of RV and HV")
    waiting_by_class: dict[str, Waiting]
    waiting_by_movement: dict[str, Waiting]
    throughput: float = Field(description="[veh/h]")
    unregulated_lane_ratio: float
    unregulated_lane_curve: tuple[float, ...] = Field(
        description="mean over each ten seconds of the whole episode, warm-up included"
    )
    lane_changes: int
    go_held_back: int
    refused_commands: int
    refusals: tuple[Words, ...] = Field(description="the most frequent reasons")
    first_gridlock: float | None = Field(
        None, description="when it began [s]; null without one, and in older records"
    )
    gridlock_exposure: float | None = Field(
        None, description="in which one could have begun [s]; null in older records"
    )


class TripMetrics(Entry):
    """The figures of whole trips over the evaluation window."""

    time_loss: float | None = Field(description="[s]")
    travel_time: float | None = Field(description="[s]")
    insertion_delay: float | None = Field(description="[s]")
    never_inserted: int = Field(description="[veh]")
    arrived: int = Field(description="[veh]")
    collisions: int = Field(description="[pairs]")
    collisions_with_robot: int = Field(description="[pairs]")
    emergency_brakings: int
    co2: float | None = Field(description="[g/km]")
    nox: float | None = Field(description="[mg/km]")
    fuel: float | None = Field(description="[g/km]")


class Versions(Entry):
    """What produced the record."""

    rightofway: Words
    sumo: Words
    python: Words


class Record(Entry):
    """One episode: one scenario, controller, rate and seed."""

    schema_: Literal[1] = Field(1, alias="schema", description="version of this format")
    scenario: Words
    controller: Words
    rate: float | None = Field(
        description="penetration rate; null stands for every rate, as no vehicle is commanded"
    )
    seed: int
    status: Literal["ok", "failed", "crashed", "timed out", "skipped"]
    reason: Words | None = Field(None, description="why it is not ok")
    rules: Literal["signals", "stop signs", "robot vehicles"] | None = None
    arbitration: Literal["flexible", "own"] | None = None
    programs: dict[str, Words] | None = Field(
        None, description="of the signals that ruled, by intersection, in words"
    )
    scenario_hash: Words
    network_hash: str | None = None
    routes_hash: str | None = None
    controller_from: Words | None = Field(
        None, description="distribution and version, or a file; SHA-256 but of Right of Way's own"
    )
    weights_hash: Words | None = None
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

    def line(self, as_read: bool = False) -> str:
        """The record as a line of JSON.

        Args:
            as_read: leave out what its file did not have.
        """
        return self.model_dump_json(by_alias=True, exclude_unset=as_read) + "\n"
