"""Every figure of the leaderboard as a formula and in words; ``metrics.py`` computes them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Formula:
    """How a figure is defined."""

    latex: str
    words: str


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

FORMULAS = {
    "average_waiting_time": Formula(
        r"\frac{1}{|P|}\sum_{t \in P}\frac{1}{n_t}\sum_{v}w_v(t)",
        "The headline, as the paper defines it: at each step the mean over the vehicles present; "
        "then the mean over the steps with a vehicle.",
    ),
    "wang_waiting_time": Formula(
        r"\frac{1}{J\,|T|}\sum_{t \in T}\sum_{j=1}^{J}\frac{1}{n_{t,j}}\sum_{v \in j}w_v(t)",
        "As Wang et al.'s code averages: over movements and all steps; an empty movement counts 0.",
    ),
    "waiting_time_per_vehicle": Formula(
        r"\frac{1}{|V|}\sum_{v \in V}w_v(t_v)", "The mean of the vehicles' final waiting times."
    ),
    "waiting_time_p95": Formula(
        r"Q_{0.95}\,\{w_v(t_v) : v \in V\}", "The 95th percentile of the same."
    ),
    "waiting_time_maximum": Formula(
        r"\max_{v \in V}\,w_v(t_v)", "The longest of the same: who is starved shows here."
    ),
    "time_loss": Formula(
        r"\frac{1}{|R|}\sum_{v \in R}l_v",
        "l is the time a vehicle lost to driving slower than it wished (SUMO's time loss). "
        "Vehicles that have not arrived count, so a jam shows.",
    ),
    "travel_time": Formula(
        r"\frac{1}{|A|}\sum_{v \in A}(a_v - d_v)", "From departure d to arrival a."
    ),
    "insertion_delay": Formula(
        r"\frac{1}{|E|}\sum_{v \in E}(d_v - p_v)",
        "From the planned departure p to the actual one d, or to the end for those still waiting "
        "to enter: what a full road keeps outside.",
    ),
    "never_inserted": Formula(
        r"|\{v : d_v > t_{\mathrm{end}}\}|", "Vehicles still waiting to enter at the end."
    ),
    "throughput": Formula(
        r"\frac{3600\,N}{|T|\,\Delta}", "N vehicles passed an entrance in the window."
    ),
    "collisions": Formula(
        r"|\{\{u, v\} : u\ \mathrm{collided\ with}\ v\}|", "Unique pairs of vehicles."
    ),
    "collisions_with_robot": Formula(
        r"|\{\{u, v\} : u\ \mathrm{collided\ with}\ v,\ u\ \mathrm{or}\ v\ \mathrm{an\ RV}\}|",
        "Of these, pairs with an RV.",
    ),
    "emergency_brakings": Formula(
        r"|\{(v, t) : v\ \mathrm{brakes\ in\ an\ emergency\ at}\ t\}|",
        "As SUMO counts them: harder than the vehicle's ordinary deceleration.",
    ),
    "unregulated_lane_ratio": Formula(
        r"\frac{1}{|T|}\sum_{t \in T}\frac{|\{k \in K : \mathrm{no\ RV\ on}\ k\ \mathrm{at}\ t\}|}"
        r"{|K|}",
        "K are the left and cross lanes of the control zone.",
    ),
    "lane_changes": Formula(
        r"|\{(v, t) : v\ \mathrm{changes\ lane\ at}\ t \in T\}|", "In the control zone."
    ),
    "go_held_back": Formula(
        r"|\{\mathrm{Go\ held\ back}\}|",
        "Go commands that the arbitration turned into Stop, over the whole episode.",
    ),
    "refused_commands": Formula(
        r"|\{\mathrm{commands\ refused}\}|", "Illegal commands, over the whole episode."
    ),
    "co2": Formula(
        r"\frac{\sum_{v} m_v}{\sum_{v} x_v}",
        "Mass m emitted over distance x driven, by SUMO's model, on every tenth vehicle.",
    ),
    "nox": Formula(r"\frac{\sum_{v} m_v}{\sum_{v} x_v}", "In the same way."),
    "fuel": Formula(r"\frac{\sum_{v} m_v}{\sum_{v} x_v}", "In the same way."),
}
"""By the keys of ``benchmark.records.leaderboard.COLUMNS``."""

MEAN = Formula(
    r"\bar{x} = \frac{1}{n}\sum_{s=1}^{n}x_s",
    "Every figure is the mean of one value x per seed s.",
)
DIFFERENCE = Formula(
    r"\bar{d} = \frac{1}{n}\sum_{s=1}^{n}(a_s - b_s)",
    "Two controllers are compared seed by seed, as they met the same vehicles.",
)
