"""What is measured: each figure once, with its place in the record, unit, formula and words.

Tables, plots, the site, CSV and `docs/methods.md` read it from here; `benchmark.world.metrics`
computes most of it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from benchmark.records.record import JunctionMetrics, TripMetrics


@dataclass(frozen=True)
class Formula:
    """A definition that is no figure of its own."""

    latex: str
    words: str


@dataclass(frozen=True)
class Measure:
    """A figure of the leaderboard."""

    key: str
    title: str
    unit: str
    digits: int
    place: str  # in a record: of one of its junctions, or of its trips
    formula: str  # LaTeX
    words: str
    brief: bool = True  # whether it is in the tables for people, not only in CSV and JSON
    more_is_better: bool = False

    @property
    def heading(self) -> str:
        """The title with the unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    @property
    def is_of_trips(self) -> bool:
        """Whether it is of whole trips through the network, not of one junction."""
        return self.place.startswith("trips.")

    @property
    def getter(self) -> Callable[[Any], float | None]:
        """What takes it from the metrics of a junction or of trips."""
        _, name, *parts = self.place.split(".")
        get: Callable[[Any], Any] = attrgetter(name)
        if not parts:
            return get
        get_part: Callable[[Any], float] = attrgetter(parts[0])
        return lambda metrics: None if (whole := get(metrics)) is None else get_part(whole)

    def value(self, junction: JunctionMetrics | None, trips: TripMetrics | None) -> float | None:
        """The figure, where it has one.

        Args:
            junction: the metrics of a junction.
            trips: those of whole trips.
        """
        metrics = trips if self.is_of_trips else junction
        return None if metrics is None else self.getter(metrics)


SYMBOLS = (
    (r"w_v(t)", "seconds that vehicle v has been stationary (below 0.1 m/s) in the control zone "
     "up to time t, counted since it entered"),
    (r"T,\ P", "the steps of the evaluation window, after warm-up until the end; those of them "
     "with a vehicle present in the control zone"),
    (r"n_t,\ n_{t,j}", "vehicles in the control zone at step t; those of movement j"),
    (r"J", "regulated movements: left turns and cross traffic of each approach"),
    (r"V,\ t_v", "vehicles that left the control zone in the window or are in it at the end; "
     "when vehicle v was last seen there"),
    (r"R,\ A,\ E", "vehicles on the road at some time in the window; those that arrived in it; "
     "those that entered in it or still wait to enter at its end"),
    (r"\Delta", "simulated time per step, in seconds"),
)  # fmt: skip
"""The symbols of the formulas, and what they stand for."""

# fmt: off
MEASURES = (
    Measure("average_waiting_time", "waiting", "s", 1, "junctions.average_waiting_time",
            r"\frac{1}{|P|}\sum_{t \in P}\frac{1}{n_t}\sum_{v}w_v(t)",
            "The headline, as the paper defines it: at each step the mean over the vehicles "
            "present; then the mean over the steps with a vehicle."),
    Measure("wang_waiting_time", "waiting (Wang)", "s", 1, "junctions.wang_waiting_time",
            r"\frac{1}{J\,|T|}\sum_{t \in T}\sum_{j=1}^{J}\frac{1}{n_{t,j}}\sum_{v \in j}w_v(t)",
            "As Wang et al.'s code averages: over movements and all steps; an empty movement "
            "counts 0."),
    Measure("waiting_time_per_vehicle", "waiting per vehicle", "s", 1,
            "junctions.waiting_time_per_vehicle.mean",
            r"\frac{1}{|V|}\sum_{v \in V}w_v(t_v)",
            "The mean of the vehicles' final waiting times.", brief=False),
    Measure("waiting_time_p95", "waiting p95", "s", 1, "junctions.waiting_time_per_vehicle.p95",
            r"Q_{0.95}\,\{w_v(t_v) : v \in V\}",
            "The 95th percentile of the same.", brief=False),
    Measure("waiting_time_maximum", "waiting maximum", "s", 1,
            "junctions.waiting_time_per_vehicle.maximum",
            r"\max_{v \in V}\,w_v(t_v)",
            "The longest of the same: who is starved shows here.", brief=False),
    Measure("vehicles", "vehicles", "veh", 0, "junctions.waiting_time_per_vehicle.vehicles",
            r"|V|",
            "Those that the vehicles' waiting times are of.", brief=False, more_is_better=True),
    Measure("time_loss", "time loss", "s", 1, "trips.time_loss",
            r"\frac{1}{|R|}\sum_{v \in R}l_v",
            "l is the time a vehicle lost to driving slower than it wished (SUMO's time loss). "
            "Vehicles that have not arrived count, so a jam shows."),
    Measure("travel_time", "travel time", "s", 1, "trips.travel_time",
            r"\frac{1}{|A|}\sum_{v \in A}(a_v - d_v)",
            "From departure d to arrival a."),
    Measure("insertion_delay", "insertion delay", "s", 1, "trips.insertion_delay",
            r"\frac{1}{|E|}\sum_{v \in E}(d_v - p_v)",
            "From the planned departure p to the actual one d, or to the end for those still "
            "waiting to enter: what a full road keeps outside."),
    Measure("never_inserted", "never inserted", "veh", 1, "trips.never_inserted",
            r"|\{v : d_v > t_{\mathrm{end}}\}|",
            "Vehicles still waiting to enter at the end.", brief=False),
    Measure("throughput", "throughput", "veh/h", 0, "junctions.throughput",
            r"\frac{3600\,N}{|T|\,\Delta}",
            "N vehicles passed an entrance in the window.", more_is_better=True),
    Measure("collisions", "collisions", "pairs", 1, "trips.collisions",
            r"|\{\{u, v\} : u\ \mathrm{collided\ with}\ v\}|",
            "Unique pairs of vehicles."),
    Measure("collisions_with_robot", "with an RV", "pairs", 1, "trips.collisions_with_robot",
            r"|\{\{u, v\} : u\ \mathrm{collided\ with}\ v,\ u\ \mathrm{or}\ v\ \mathrm{an\ RV}\}|",
            "Of these, pairs with an RV."),
    Measure("emergency_brakings", "emergency brakings", "", 1, "trips.emergency_brakings",
            r"|\{(v, t) : v\ \mathrm{brakes\ in\ an\ emergency\ at}\ t\}|",
            "As SUMO counts them: harder than the vehicle's ordinary deceleration.", brief=False),
    Measure("unregulated_lane_ratio", "unregulated lanes", "share", 2,
            "junctions.unregulated_lane_ratio",
            r"\frac{1}{|T|}\sum_{t \in T}\frac{|\{k \in K : \mathrm{no\ RV\ on}\ k\ \mathrm{at}\ "
            r"t\}|}{|K|}",
            "K are the left and cross lanes of the control zone."),
    Measure("lane_changes", "lane changes", "", 0, "junctions.lane_changes",
            r"|\{(v, t) : v\ \mathrm{changes\ lane\ at}\ t \in T\}|",
            "In the control zone.", brief=False),
    Measure("go_held_back", "Go held back", "", 0, "junctions.go_held_back",
            r"|\{\mathrm{Go\ held\ back}\}|",
            "Go commands that the arbitration turned into Stop, over the whole episode.",
            brief=False),
    Measure("refused_commands", "refused commands", "", 0, "junctions.refused_commands",
            r"|\{\mathrm{commands\ refused}\}|",
            "Illegal commands, over the whole episode.", brief=False),
    Measure("first_gridlock", "first gridlock", "s", 0, "junctions.first_gridlock",
            r"t_g",
            "When the first gridlock began, over the episodes that had one.", brief=False),
    Measure("gridlock_exposure", "gridlock exposure", "s", 0, "junctions.gridlock_exposure",
            r"t_e",
            "How long a first gridlock could begin and be known of: up to it, else up to the end "
            "less the time that it takes to be one.", brief=False, more_is_better=True),
    Measure("co2", "CO2", "g/km", 0, "trips.co2",
            r"\frac{\sum_{v} m_v}{\sum_{v} x_v}",
            "Mass m emitted over distance x driven, by SUMO's model, on every tenth vehicle.",
            brief=False),
    Measure("nox", "NOx", "mg/km", 0, "trips.nox",
            r"\frac{\sum_{v} m_v}{\sum_{v} x_v}",
            "In the same way.", brief=False),
    Measure("fuel", "fuel", "g/km", 1, "trips.fuel",
            r"\frac{\sum_{v} m_v}{\sum_{v} x_v}",
            "In the same way.", brief=False),
)
# fmt: on
HEADLINE = MEASURES[0]
BY_KEY = {measure.key: measure for measure in MEASURES}

GRIDLOCK = Formula(
    r"p = 1 - e^{-\hat{\lambda}\,3600},\quad \hat{\lambda} = \frac{n_g}{\sum_{s=1}^{n}t_{e,s}}",
    "The probability of a gridlock within an hour, from the n_g episodes that had one, as if it "
    "came at a constant rate; the interval is Garwood's exact one for that rate.",
)
MEAN = Formula(
    r"\bar{x} = \frac{1}{n}\sum_{s=1}^{n}x_s",
    "Every figure is the mean of one value x per seed s.",
)
DIFFERENCE = Formula(
    r"\bar{d} = \frac{1}{n}\sum_{s=1}^{n}(a_s - b_s)",
    "Two controllers are compared seed by seed, as they met the same vehicles.",
)
