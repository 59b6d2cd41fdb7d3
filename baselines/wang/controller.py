"""Wang et al.'s learned Go/Stop controllers, with the weights that ship."""

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import ClassVar

from baselines.wang.policy import Greedy, Network
from benchmark.control.arbitration import undecided
from benchmark.control.controller import Command, Controller, Go, Stop
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle
from benchmark.control.training import declared_training
from benchmark.learning.observation import Layout, Observer
from benchmark.learning.weights import Notes, Weights, load
from benchmark.scenario.scenario import Scenario

SHIPPED = Path(__file__).parent / "weights"


def on_the_left(name: str, scenario: Scenario) -> str | None:
    """Why a learned controller is skipped where traffic drives on the left."""
    sides = {ruled.zones.driving_side for ruled in scenario.junctions.values()}
    return f"{name}: trained for traffic that drives on the right" if "left" in sides else None


class Wang(Controller):
    """Wang et al.'s learned Go/Stop policy, shared by all RVs, as published.

    Args:
        weights: a file as ``rightofway train`` writes it, of any layout, width and number of
            atoms; default: what ships.

    Raises:
        ControllerError: the weights are missing, damaged or of another network.
    """

    NAME: ClassVar[str] = "wang"
    LAYOUT: ClassVar[Layout] = "paper"
    """Of the weights that ship, and of those whose file notes none."""

    def __init__(self, weights: Path | None = None) -> None:
        self._weights = _read(weights or SHIPPED / f"{self.NAME}.safetensors", self.LAYOUT)
        self._layout = _network(self._weights.notes, self.LAYOUT).layout
        self.weights_hash = self._weights.hash
        self.trained_on = declared_training(self._weights.notes)
        self._policy = Greedy(self._weights.arrays)

    def supports(self, scenario: Scenario) -> str | None:
        """Skip where traffic drives on the left: what it observes names left turns."""
        return on_the_left(self.NAME, scenario) or super().supports(scenario)

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Look at another intersection; the policy itself remembers nothing."""
        self._observer = Observer(intersection, self._layout)

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """Go or Stop for every RV that decides, in one forward pass."""
        going = self.going(state, self._to_ask(state))
        return {ego.id: Go() if ego.id in going else Stop() for ego in state.deciding}

    def going(self, state: TrafficState, egos: Sequence[Vehicle]) -> set[str]:
        """The ids of those among some RVs in the decision zone that say Go."""
        if not egos:
            return set()
        actions = self._policy(self._observer.observe(state, egos))
        return {ego.id for ego, go in zip(egos, actions, strict=True) if go}

    def _to_ask(self, state: TrafficState) -> Sequence[Vehicle]:
        """The RVs whose decision moves them; to ask the others is slow and changes nothing.

        In the extended layout all: what an RV decided before is part of what it observes.
        """
        return state.deciding if self._layout == "extended" else undecided(state)


class WangTuned(Wang):
    """Wang's method with reward and observation chosen by ablation."""

    NAME = "wang-tuned"
    LAYOUT = "extended"


@cache
def _read(path: Path, layout: Layout) -> Weights:
    remedy = "reinstall rightofway, or train with `rightofway train`"
    return load(path, lambda notes: _network(notes, layout).shapes, remedy)


def _network(notes: Notes, layout: Layout) -> Network:
    return Network.model_validate({"layout": layout, **notes})
