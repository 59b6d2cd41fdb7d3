"""The safety mechanism: speed limits that fall towards the entrance (paper, "Safety Mechanism")."""

import math

from benchmark.control.state import Vehicle

ZONES = ((5.0, 0.0), (10.0, 1.0), (20.0, 2.0), (30.0, 3.0))
"""Up to which distance to the entrance [m] which speed limit holds [m/s]; the nearest first."""


def speed_limit(distance: float) -> float:
    """The limit for an RV that is not cleared to enter [m/s]; infinite beyond the zones.

    Args:
        distance: to the entrance [m]; a zone holds its far edge and not its near one.
    """
    return next((limit for edge, limit in ZONES if distance <= edge), math.inf)


def with_braking(vehicle: Vehicle, acceleration: float, step: float) -> float:
    """An acceleration after automatic braking [m/s2].

    Args:
        vehicle: an RV that is not cleared to enter.
        acceleration: that it wants [m/s2].
        step: simulated time per step [s].

    Returns:
        What is wanted where that keeps the limit; else what leads to the limit, or the hardest
        braking where that is not enough.
    """
    to_limit = (speed_limit(vehicle.distance) - vehicle.speed) / step
    return max(min(acceleration, to_limit), -vehicle.body.deceleration)
