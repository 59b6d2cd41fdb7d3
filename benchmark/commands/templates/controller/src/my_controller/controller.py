"""RVs let the movements go that have waited longest: a start, to be replaced by your idea."""

from collections.abc import Mapping

from benchmark import Command, Controller, Go, Intersection, Stop, TrafficState


class MyController(Controller):
    """The conflict-free set of movements goes that has waited longest in all."""

    # The first line above describes the controller in tables. What it needs, it declares: elsewhere
    # it is skipped, with the reason in the record. These are the defaults.
    rules = "robot vehicles"  # lights are dark; "signals": lights are on, and RVs are free to drive
    arbitration = "flexible"  # conflicts hold a Go back; "own": nothing does, so mind collisions
    needs_robot_vehicles = True  # False: it commands no vehicle
    rates = (0.0, 1.0)  # the least and the greatest penetration rate it is made for
    approaches = None  # how many approaches it can steer, as in {3, 4}; None: any number

    def __init__(self, hold: float = 10.0) -> None:
        """Keyword arguments are options, as in ``my-controller?hold=15``.

        Args:
            hold: how long a set keeps its turn [s].
        """
        self._hold = hold

    def reset(self, intersection: Intersection, seed: int) -> None:
        """A new episode: set anew whatever ``act`` changes.

        Args:
            intersection: lanes, movements and conflicts; see ``Intersection``.
            seed: the only source of randomness, as in ``random.Random(seed)``.
        """
        # Sorted, because the order of Python's sets differs from process to process.
        self._sets = sorted(sorted(chosen) for chosen in intersection.conflict_free_sets)
        self._turn: list[str] = []  # ids of the movements that go, such as "E-L"
        self._until = 0.0  # s

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """The commands for the next step; an RV without one drives itself as a human would.

        Args:
            state: vehicles, queues, waiting and more, with units; see ``TrafficState``.
        """
        if state.time >= self._until:
            self._turn = max(self._sets, key=lambda chosen: self._waiting(state, chosen))
            self._until = state.time + self._hold
        return {
            vehicle.id: Go() if vehicle.movement in self._turn else Stop()
            for vehicle in state.deciding  # the RVs whose Go and Stop count
        }

    def _waiting(self, state: TrafficState, chosen: list[str]) -> float:
        """Seconds that the vehicles of these movements have stood in the control zone."""
        movements = [state.movements[name] for name in chosen]
        return sum(movement.waiting * movement.vehicles for movement in movements)
