"""Whether an episode is long enough to show what comes of doing nothing."""

from benchmark.control.state import TrafficState
from benchmark.scenario.demand import busiest
from benchmark.scenario.scenario import Scenario
from benchmark.world.world import World

HOUR = 3600.0  # s
SEED = 1
JAMMED = 60.0  # s, mean waiting of the vehicles present


def time_to_jam(scenario: Scenario, seed: int = SEED) -> float | None:
    """When an hour of the busiest demand jams under dark lights where nobody regulates [s].

    It has jammed where it is gridlocked, or where the vehicles present have waited a minute on
    average: queues that lock each other in part let a few through for long.

    Args:
        scenario: where; its counts are the average of its busiest 15 minutes.
        seed: of the demand.

    Returns:
        None where it does not.

    Raises:
        RightOfWayError: the scenario cannot be run.
    """
    period = busiest(scenario.demand).model_copy(update={"begin": 0.0, "end": HOUR})
    evaluation = scenario.evaluation.model_copy(update={"duration": HOUR, "warm_up": 0.0})
    hour = scenario.model_copy(update={"demand": (period,), "evaluation": evaluation})
    with World(hour, 0.0, seed, controller="nobody", arbitration="own") as world:
        while not world.over:
            for name, state in world.step().items():
                if world.sites[name].gridlock.gridlocked or _mean_waiting(state) > JAMMED:
                    return state.time
    return None


def _mean_waiting(state: TrafficState) -> float:
    waits = [vehicle.waiting for vehicle in state.vehicles]
    return sum(waits) / len(waits) if waits else 0.0


def too_short(scenario: Scenario) -> str | None:
    """Why an episode is too short to show what comes of doing nothing, in words; None if not."""
    duration = scenario.evaluation.duration
    if duration >= HOUR or (jam := time_to_jam(scenario)) is None or jam <= duration:
        return None
    return (
        f"evaluation.duration: {duration:g} s are too short to show what comes of doing nothing: "
        f"under dark lights the intersection jams after {jam:.0f} s (seed {SEED}); let an episode "
        "last longer, or ask for more traffic"
    )
