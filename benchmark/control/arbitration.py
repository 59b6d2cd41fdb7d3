"""What a controller may foresee of the rules: whether a Go is held back, and how an RV is stopped.

``benchmark.world.rules`` decides by the same functions.
"""

import math

from benchmark.control.state import TrafficState, Vehicle

STOP_MARGIN = 1.0  # m before the entrance at which a stopped RV's front comes to rest
COMFORTABLE = 2.0  # m/s2, the braking of a Stop where there is room for it
CELLS_FOR_LONGEST = 3  # occupied cells that hold back the longest waiting movement
CELLS_FOR_OTHERS = 8  # and the others (flexible arbitration of Wang et al.)


def held_by_conflict(state: TrafficState, movement: str) -> bool:
    """Whether the flexible arbitration holds back a Go of a movement.

    A Go waits while a conflicting movement has a vehicle in the first eight of its ten cells; for
    the movement with the longest mean waiting only the first three count (Wang et al., conflict
    mechanism "flexible").
    """
    cells = CELLS_FOR_LONGEST if movement == state.longest_waiting else CELLS_FOR_OTHERS
    conflicts = state.intersection.movements[movement].conflicts
    return any(
        crossing.movement in conflicts and crossing.cell < cells for crossing in state.inside
    )


def stopping_speed(distance: float, deceleration: float, step: float) -> float:
    """The greatest speed in the next step from which braking ends before the entrance [m/s].

    After a step at speed v the rest of the way must hold the braking distance:
    ``distance - STOP_MARGIN - v * step >= v**2 / (2 * deceleration)``, solved for v.

    Args:
        distance: to the entrance [m].
        deceleration: positive [m/s2].
        step: simulated time per step [s].
    """
    room = max(0.0, distance - STOP_MARGIN)
    change = deceleration * step
    return math.sqrt(change * change + 2 * deceleration * room) - change


def can_stop(vehicle: Vehicle) -> bool:
    """Whether braking as hard as it can would end before the entrance."""
    return vehicle.speed**2 / (2 * vehicle.body.deceleration) < vehicle.distance


def undecided(state: TrafficState) -> list[Vehicle]:
    """The RVs in the decision zone that Go and Stop would give different orders.

    The others accelerate fully under both, being far from the entrance for their speed, or are
    stopped under both, because the flexible arbitration would hold their Go back.
    """
    step, blocked = state.intersection.step, dict[str, bool]()
    open_choices = []
    for vehicle in state.deciding:
        fastest = vehicle.speed + vehicle.body.acceleration * step
        if fastest <= stopping_speed(vehicle.distance, COMFORTABLE, step):
            continue
        if (movement := vehicle.movement) not in blocked:
            blocked[movement] = held_by_conflict(state, movement)
        if not (blocked[movement] and can_stop(vehicle)):
            open_choices.append(vehicle)
    return open_choices
