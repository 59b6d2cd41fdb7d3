"""One junction's log -> its figures."""

from dataclasses import dataclass

import numpy as np

from benchmark.records.record import JunctionMetrics
from benchmark.scenario.evaluation import Evaluation
from benchmark.sumo.junction import Junction
from benchmark.world import metrics
from benchmark.world.gridlock import GridlockWatch
from benchmark.world.rules import Rules
from benchmark.world.tracking import Log

REASONS_KEPT = 5  # kinds of refused commands named in a record


def junction_metrics(
    evaluation: Evaluation, junction: Junction, log: Log, rules: Rules, gridlock: GridlockWatch
) -> JunctionMetrics:
    """The figures of one junction in one episode.

    Args:
        evaluation: which window counts.
        junction: where.
        log: who was in its control zone.
        rules: what they refused and held back.
        gridlock: whether it locked up.
    """
    seen = Sights.of(junction, log)
    steps, start = seen.steps, metrics.window_start(log.times, evaluation.warm_up)
    window = seen.step >= start
    counted = window & (seen.movement >= 0)
    last = metrics.last_sights(seen.step, seen.vehicle, start)
    finals = seen.waiting[last]
    who = [log.vehicles[index] for index in seen.vehicle[last]]
    unregulated = metrics.unregulated_ratios(
        seen.step, seen.lane, seen.is_robot, seen.regulated_lanes, steps
    )
    reasons = rules.refusals.most_common(REASONS_KEPT)
    return JunctionMetrics(
        average_waiting_time=metrics.average_waiting_time(seen.step[window], seen.waiting[window]),
        wang_waiting_time=metrics.wang_waiting_time(
            step=seen.step[counted] - start,
            movement=seen.movement[counted],
            waiting=seen.waiting[counted],
            movements=len(junction.intersection.regulated_movements),
            steps=steps - start,
        ),
        waiting_time_per_vehicle=metrics.waiting_of(finals),
        waiting_by_kind=metrics.waiting_by(finals, ["RV" if v.is_robot else "HV" for v in who]),
        waiting_by_class=metrics.waiting_by(finals, [v.body.vehicle_class for v in who]),
        waiting_by_movement=metrics.waiting_by(finals, [v.movement for v in who]),
        throughput=metrics.throughput(seen.step[last], start, steps, evaluation.step),
        unregulated_lane_ratio=float(np.mean(unregulated[start:])),
        unregulated_lane_curve=metrics.curve(unregulated, evaluation.step),
        lane_changes=metrics.lane_changes(seen.step, seen.vehicle, seen.lane, seen.lane_row, start),
        go_held_back=rules.held_back,
        refused_commands=rules.refusals.total(),
        refusals=tuple(f"{reason} ({count} times)" for reason, count in reasons),
        first_gridlock=gridlock.first,
        gridlock_exposure=gridlock.exposure,
    )


@dataclass(frozen=True)
class Sights:
    """A log as arrays: an entry per vehicle and step, unless said otherwise."""

    steps: int
    step: metrics.Ints
    vehicle: metrics.Ints
    lane: metrics.Ints
    waiting: metrics.Floats
    movement: metrics.Ints  # index among the regulated movements, -1 for the others
    is_robot: metrics.Bools
    regulated_lanes: metrics.Bools  # by lane
    lane_row: metrics.Ints  # by lane; lanes beside each other share a row

    @classmethod
    def of(cls, junction: Junction, log: Log) -> "Sights":
        """The sights of one junction's episode."""
        movements = {name: i for i, name in enumerate(junction.intersection.regulated_movements)}
        rows: dict[tuple[str, float], int] = {}
        places = [junction.zone[lane] for lane in log.lanes]
        vehicle = np.asarray(log.vehicle, dtype=np.int64)
        movement = np.asarray([movements.get(v.movement, -1) for v in log.vehicles], dtype=np.int64)
        robots = np.asarray([vehicle.is_robot for vehicle in log.vehicles], dtype=bool)
        regulated = set(junction.intersection.regulated_lanes)
        return cls(
            steps=len(log.times),
            step=np.repeat(np.arange(len(log.times)), np.asarray(log.present, dtype=np.int64)),
            vehicle=vehicle,
            lane=np.asarray(log.lane, dtype=np.int64),
            waiting=np.asarray(log.waiting, dtype=np.float64),
            movement=movement[vehicle],
            is_robot=robots[vehicle],
            regulated_lanes=np.asarray([lane in regulated for lane in log.lanes]),
            lane_row=np.asarray([rows.setdefault((p.approach, p.end), len(rows)) for p in places]),
        )
