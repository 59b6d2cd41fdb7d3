"""The figures of the leaderboard: where each is in a record, its title, unit and digits."""

from collections.abc import Callable
from dataclasses import dataclass

from benchmark.records.record import JunctionMetrics, TripMetrics

Getter = Callable[[JunctionMetrics, TripMetrics], float | None]


@dataclass(frozen=True, slots=True)
class Column:
    """A figure of the leaderboard."""

    key: str
    title: str
    unit: str
    digits: int
    get: Getter
    brief: bool = True  # whether it is in the tables for people, not only in CSV and JSON
    more_is_better: bool = False


COLUMNS = (
    Column("average_waiting_time", "waiting", "s", 1, lambda j, t: j.average_waiting_time),
    Column("wang_waiting_time", "waiting (Wang)", "s", 1, lambda j, t: j.wang_waiting_time),
    Column(
        *("waiting_time_per_vehicle", "waiting per vehicle", "s", 1),
        lambda j, t: j.waiting_time_per_vehicle.mean if j.waiting_time_per_vehicle else None,
        brief=False,
    ),
    Column(
        *("waiting_time_p95", "waiting p95", "s", 1),
        lambda j, t: j.waiting_time_per_vehicle.p95 if j.waiting_time_per_vehicle else None,
        brief=False,
    ),
    Column(
        *("waiting_time_maximum", "waiting maximum", "s", 1),
        lambda j, t: j.waiting_time_per_vehicle.maximum if j.waiting_time_per_vehicle else None,
        brief=False,
    ),
    Column("time_loss", "time loss", "s", 1, lambda j, t: t.time_loss),
    Column("travel_time", "travel time", "s", 1, lambda j, t: t.travel_time),
    Column("insertion_delay", "insertion delay", "s", 1, lambda j, t: t.insertion_delay),
    Column("never_inserted", "never inserted", "veh", 1, lambda j, t: t.never_inserted, False),
    Column(
        *("throughput", "throughput", "veh/h", 0, lambda j, t: j.throughput),
        more_is_better=True,
    ),
    Column("collisions", "collisions", "pairs", 1, lambda j, t: t.collisions),
    Column("collisions_with_robot", "with an RV", "pairs", 1, lambda j, t: t.collisions_with_robot),
    Column(
        *("emergency_brakings", "emergency brakings", "", 1),
        lambda j, t: t.emergency_brakings,
        brief=False,
    ),
    Column(
        *("unregulated_lane_ratio", "unregulated lanes", "share", 2),
        lambda j, t: j.unregulated_lane_ratio,
    ),
    Column("lane_changes", "lane changes", "", 0, lambda j, t: j.lane_changes, False),
    Column("go_held_back", "Go held back", "", 0, lambda j, t: j.go_held_back, False),
    Column("refused_commands", "refused commands", "", 0, lambda j, t: j.refused_commands, False),
    Column("co2", "CO2", "g/km", 0, lambda j, t: t.co2, False),
    Column("nox", "NOx", "mg/km", 0, lambda j, t: t.nox, False),
    Column("fuel", "fuel", "g/km", 1, lambda j, t: t.fuel, False),
)
HEADLINE = COLUMNS[0]
