"""What is a gridlock, and when it began."""

from collections.abc import Sequence

from factories.traffic import CROSSROADS, crossing, state, vehicle

from benchmark.control.state import Crossing
from benchmark.scenario.signal import Signal, SignalPhase
from benchmark.world.gridlock import GridlockWatch, gridlock_after

STANDS = vehicle("hv", speed=0.0)


def watched(*, until: float, at: float = -1.0, who: Sequence[Crossing] = ()) -> GridlockWatch:
    """A watch on an intersection where one vehicle stands, and others are inside at a time."""
    watch = GridlockWatch(CROSSROADS)
    time = 0.0
    while time < until:
        time += 1
        watch.see(state(STANDS, *(who if time == at else ()), time=time))
    return watch


def test_where_somebody_stands_and_nobody_enters_for_90_s_it_is_one_that_began_then() -> None:
    assert not watched(until=89).gridlocked
    watch = watched(until=90)
    assert (watch.gridlocked, watch.first, watch.exposure) == (True, 0.0, 0.0)


def test_who_enters_ends_the_wait_and_who_stays_inside_does_not() -> None:
    watch = watched(until=129, at=40, who=(crossing("E-C"),))
    assert (watch.gridlocked, watch.first) == (False, None)
    watch = watched(until=130, at=40, who=(crossing("E-C"),))
    assert (watch.gridlocked, watch.first, watch.exposure) == (True, 40.0, 40.0)
    watch = GridlockWatch(CROSSROADS)
    for time in range(1, 92):
        watch.see(state(STANDS, crossing("E-C"), time=float(time)))
    assert watch.first == 1.0


def test_right_turns_neither_make_nor_prevent_one() -> None:
    assert watched(until=90, at=40, who=(crossing("E-R"),)).gridlocked
    watch = GridlockWatch(CROSSROADS)
    for time in range(200):
        watch.see(state(vehicle(movement="E-R", speed=0.0), time=float(time)))
    assert not watch.gridlocked


def test_an_empty_or_moving_road_is_none_and_all_but_the_last_90_s_count() -> None:
    watch = GridlockWatch(CROSSROADS)
    for time in range(1, 601):
        watch.see(state(vehicle(speed=5.0), time=float(time)))
    assert (watch.gridlocked, watch.first, watch.exposure) == (False, None, 510.0)


def test_the_first_one_stays_the_first() -> None:
    watch = watched(until=300, at=200, who=(crossing("E-C"),))
    assert (watch.gridlocked, watch.first) == (True, 0.0)


def test_a_red_light_is_no_gridlock_before_its_cycle_is_over() -> None:
    phases = tuple(SignalPhase(movements=(name,), green=60) for name in ("N-C", "E-C"))
    signal = Signal(yellow=3, all_red=2, phases=phases)
    assert (gridlock_after(signal), gridlock_after(None)) == (130.0, 90.0)
    short = tuple(phase.model_copy(update={"green": 20.0}) for phase in phases)
    assert gridlock_after(Signal(phases=short)) == 90.0
