"""What every hierarchy shares: a low level that drives the RVs that the top level stops."""

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field, PositiveInt, TypeAdapter

from baselines.hierarchical.observation import SIDES, Side, beside
from baselines.hierarchical.policy import (
    LEFT,
    RIGHT,
    Forward,
    Learned,
    LowLevel,
    LowLevelObserver,
    Random,
    shapes,
)
from baselines.wang.controller import on_the_left
from benchmark.control.controller import Command, Controller, Drive
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle
from benchmark.control.training import declared_training
from benchmark.learning.weights import Weights, load
from benchmark.scenario.scenario import Scenario

SHIPPED = Path(__file__).parent / "weights"
HIDDEN = (64, 64)  # where a file's notes say nothing else
WIDTHS = TypeAdapter(Annotated[tuple[PositiveInt, ...], Field(min_length=1)])

Low = Literal["learned", "forward", "random"]
Training = Annotated[int, Field(ge=1, le=3)]
"""One of the shipped weights, by the seed of their training."""


class Hierarchy(Controller):
    """Two levels: the top says who enters, the low one drives those who may not.

    Args:
        low: who drives RVs that may not enter: the learned policy, one that only drives on, or a
            random one.
        lateral: whether RVs change lanes.
        training: which shipped weights it follows; default: the median of three on validation.
        weights: other weights, a file as ``rightofway train`` writes it.
    """

    NAME: ClassVar[str]
    SIZE: ClassVar[int]
    MEDIAN: ClassVar[Training]

    def __init__(
        self,
        *,
        low: Low = "learned",
        lateral: bool = True,
        training: Training | None = None,
        weights: Path | None = None,
    ) -> None:
        self._low, self._lateral = low, lateral
        if low == "learned":
            shipped = SHIPPED / f"{self.NAME}-{training or self.MEDIAN}.safetensors"
            self._weights = _read(weights or shipped, self.SIZE)
            self.weights_hash = self._weights.hash
            self.trained_on = declared_training(self._weights.notes)

    def supports(self, scenario: Scenario) -> str | None:
        """Skip where traffic drives on the left: what it observes names left turns."""
        return on_the_left(self.NAME, scenario) or super().supports(scenario)

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Look at another intersection."""
        self._intersection = intersection
        self._beside = beside(intersection)
        self.observer = self._observer()
        if self._low == "learned":
            self.low_level: LowLevel = Learned(self._weights.arrays, self.observer)
        else:
            self.low_level = Random(seed) if self._low == "random" else Forward()

    @abstractmethod
    def concerned(self, state: TrafficState) -> Iterable[Vehicle]:
        """The RVs that the low level may drive, those that may enter just now included."""

    @abstractmethod
    def _observer(self) -> LowLevelObserver:
        """What the low level sees with."""

    @abstractmethod
    def _limited(self, ego: Vehicle, acceleration: float) -> float:
        """An acceleration after the safety mechanism [m/s2]."""

    def _drive(self, state: TrafficState, egos: Sequence[Vehicle]) -> dict[str, Command]:
        """The low level's commands for RVs that may not enter."""
        if not egos:
            return {}
        actions = self.low_level(state, egos)
        return {
            ego.id: self._command(ego, *action)
            for ego, action in zip(egos, actions.tolist(), strict=True)
        }

    def _command(self, ego: Vehicle, acceleration: float, lane_change: float) -> Drive:
        """The command of an action (paper, "Action Space").

        Args:
            ego: an RV that may not enter.
            acceleration: -1 is its hardest braking, 1 its greatest acceleration.
            lane_change: below -0.33 to the left, above 0.33 to the right.
        """
        body = ego.body
        wanted = acceleration * (body.acceleration if acceleration > 0 else body.deceleration)
        side = self._side(ego, lane_change) if self._lateral else 0
        return Drive(self._limited(ego, wanted), side)

    def _side(self, ego: Vehicle, lane_change: float) -> Side:
        """The lane change that is asked for, where the lane on that side serves the movement."""
        if LEFT <= lane_change <= RIGHT:
            return 0
        index = 0 if lane_change < LEFT else 1
        lane = self._beside.get(ego.lane, (None, None))[index]
        if lane is None or ego.movement not in self._intersection.lanes[lane].movements:
            return 0
        return SIDES[index]


@cache
def _read(path: Path, size: int) -> Weights:
    return load(
        path,
        lambda notes: shapes(size, WIDTHS.validate_python(notes.get("hidden", HIDDEN))),
        "reinstall rightofway, or train with `rightofway train`",
    )
