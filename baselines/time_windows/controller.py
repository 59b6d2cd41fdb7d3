"""Time windows: an RV enters when its windows on all conflict stretches are free."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from pydantic import NonNegativeFloat, NonNegativeInt, PositiveFloat

from baselines.time_windows.lane_changes import lane_changes, speeding_up
from baselines.time_windows.prediction import Predictor
from baselines.time_windows.queues import Platoon, Queue, survey, to_the_line
from baselines.time_windows.ranking import Ranking, RankWeights
from baselines.time_windows.reservations import Ledger, Margins
from baselines.time_windows.stretches import lane_conflicts, movement_conflicts
from benchmark.control.controller import Command, Controller, Drive
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle

SLOT = 1.0  # s between two later slots


@dataclass(frozen=True, slots=True)
class Decisions:
    """What became of a step's RVs that can stop; those not named here are not asked yet."""

    queues: Sequence[Queue]  # all lanes
    accepted: list[Vehicle] = field(default_factory=list)
    refused: list[Vehicle] = field(default_factory=list)  # the first of each lane to be refused


class TimeWindows(Controller):
    """RVs reserve time windows where ways meet; a rule that needs no training and no lights.

    docs/time-windows.md explains the rule. The defaults come from a search on validation seeds.

    Args:
        clearance: ways conflict where their centre lines are closer than this [m].
        stretches: windows on the stretches where lanes' ways meet, or on whole ways of
            conflicting movements.
        after: margin behind the end of a reserved window [s].
        before: margin ahead of the start of a reserved window [s].
        growth: seconds by which windows widen for each second of look-ahead [1].
        yielding: an HV that arrives this much later stops for who is inside by then [s].
        acceleration: with which vehicles are expected to speed up [m/s2].
        headway: least time between two vehicles of a lane at the entrance [s].
        creeping: a vehicle inside that is slower than this may be held up [m/s].
        creeping_delay: by how much later it may then leave [s].
        look_ahead: vehicles that arrive later than this do not count yet [s].
        followers: how many HVs behind an RV must be able to pass as well; nobody could hold
            them back then.
        waiting_weight: vehicles that a second of waiting is worth in a lane's rank [1/s].
        longest_waiting: waiting counts up to this [s].
        flowing: factor of a lane's rank while its movement flows [1].
        joining: factor for a movement that could join those that flow [1].
        green: for how long a movement flows with its factor [s].
        green_gap: without an accepted RV for this long, a movement flows no more [s].
        patience: everybody makes way for a lane's first RV after it was refused this long [s].
        later_slots: how many refused RVs may book a later slot.
        latest_slot: how much later a slot may be [s].
        braking: with which a refused RV brakes [m/s2].
        spread: whether RVs change lanes to lead one that no RV leads.
        spread_from: but no closer to the entrance than this [m].
        spread_gap: nor where a vehicle of that lane is closer than this, front to front [m].
    """

    arbitration: ClassVar[Literal["flexible", "own"]] = "own"

    def __init__(
        self,
        *,
        clearance: PositiveFloat = 2.8,
        stretches: Literal["lanes", "movements"] = "lanes",
        after: NonNegativeFloat = 0.4,
        before: NonNegativeFloat = 2.2,
        growth: NonNegativeFloat = 0.28,
        yielding: NonNegativeFloat = 2.0,
        acceleration: PositiveFloat = 1.4,
        headway: NonNegativeFloat = 1.4,
        creeping: NonNegativeFloat = 1.0,
        creeping_delay: NonNegativeFloat = 7.0,
        look_ahead: PositiveFloat = 14.0,
        followers: NonNegativeInt = 0,
        waiting_weight: NonNegativeFloat = 0.18,
        longest_waiting: NonNegativeFloat = 140.0,
        flowing: NonNegativeFloat = 2.0,
        joining: NonNegativeFloat = 5.0,
        green: NonNegativeFloat = 5.0,
        green_gap: NonNegativeFloat = 3.0,
        patience: NonNegativeFloat = 240.0,
        later_slots: NonNegativeInt = 6,
        latest_slot: NonNegativeFloat = 3.0,
        braking: PositiveFloat = 4.0,
        spread: bool = True,
        spread_from: NonNegativeFloat = 15.0,
        spread_gap: NonNegativeFloat = 7.5,
    ) -> None:
        self._clearance, self._stretches = clearance, stretches
        self._prediction = (acceleration, headway, creeping, creeping_delay)
        self._look_ahead, self._followers, self.braking = look_ahead, followers, braking
        self._margins = Margins(after, before, growth, look_ahead, yielding)
        self._weights = RankWeights(
            waiting=waiting_weight,
            longest_waiting=longest_waiting,
            flowing=flowing,
            joining=joining,
            green=green,
            gap=green_gap,
            patience=patience,
        )
        self._later_slots = later_slots
        self._delays = [SLOT * slot for slot in range(1, int(latest_slot / SLOT) + 1)]
        self._spread, self._spread_from, self._spread_gap = spread, spread_from, spread_gap

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Look at an intersection and forget what flowed."""
        self._intersection = intersection
        conflicts = (
            lane_conflicts(intersection, self._clearance)
            if self._stretches == "lanes"
            else movement_conflicts(intersection)
        )
        self._ways = {
            (movement, way.lane): index
            for index, (movement, way) in enumerate(
                zip(conflicts.movements, conflicts.ways, strict=True)
            )
        }
        self._predictor = Predictor(conflicts, *self._prediction)
        self._ranking = Ranking(intersection, self._weights)

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """Refused RVs brake, some change lanes, and all others drive by themselves."""
        decisions = self.decide(state)
        commands: dict[str, Command] = dict(self._brake(decisions.refused))
        if self._spread:
            decided = {vehicle.id for vehicle in (*decisions.accepted, *decisions.refused)}
            commands |= self._change_lanes(decisions.queues, decided)
        return commands

    def decide(self, state: TrafficState) -> Decisions:
        """Who may enter now and who may not, and take note of it."""
        now = survey(state, self._ways, self._predictor, self._look_ahead)
        decisions = Decisions(now.queues)
        heads: list[Vehicle] = []
        if any(queue.platoons for queue in now.queues):
            ledger = Ledger(self._predictor.windows(now.passages), self._margins)
            ledger.reserve(now.committed)
            heads = self._arbitrate(ledger, decisions, state.time)
        self._ranking.remember(decisions.accepted, heads, state.time)
        return decisions

    def _arbitrate(self, ledger: Ledger, decisions: Decisions, time: float) -> list[Vehicle]:
        """Fill in who is accepted and who refused.

        Returns:
            The refused RVs that are the first of their lane.
        """
        heads: list[Vehicle] = []
        slots = self._later_slots
        for queue in self._ranking.order(decisions.queues, time):
            first = queue.platoons[0]
            for platoon in queue.platoons:
                if self._can_pass(ledger, platoon):
                    ledger.reserve(_bits(platoon))
                    decisions.accepted.append(platoon.leader)
                    continue
                decisions.refused.append(platoon.leader)
                if platoon is first:
                    heads.append(platoon.leader)
                    if self._ranking.overdue(queue, time):
                        ledger.clear_the_way(platoon.index)
                    elif slots and ledger.book(platoon.index, self._delays) is not None:
                        slots -= 1
                break
        return heads

    def _can_pass(self, ledger: Ledger, platoon: Platoon) -> bool:
        """Whether an RV can pass, and the HVs behind it that count."""
        counting = (platoon.index, *platoon.followers[: self._followers])
        return all(ledger.free(index) for index in counting)

    def _brake(self, refused: Sequence[Vehicle]) -> Iterator[tuple[str, Command]]:
        step = self._intersection.step
        for vehicle in refused:
            change = to_the_line(vehicle, self.braking, step)
            if change < vehicle.body.acceleration:
                yield vehicle.id, Drive(change)

    def _change_lanes(
        self, queues: Sequence[Queue], stay: set[str]
    ) -> Iterator[tuple[str, Command]]:
        lanes, step = self._intersection.lanes, self._intersection.step
        for vehicle, side in lane_changes(
            self._intersection, queues, stay, self._spread_from, self._spread_gap
        ):
            yield vehicle.id, Drive(speeding_up(vehicle, lanes, step), side)


def _bits(platoon: Platoon) -> int:
    return sum(1 << index for index in (platoon.index, *platoon.followers))
