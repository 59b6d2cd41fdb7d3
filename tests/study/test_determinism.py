"""Equal inputs give equal records, bit for bit: on repeat, in any order, in any process."""

from functools import cache
from itertools import pairwise

import libsumo
import pytest
from factories.episodes import lines, watched
from factories.scenarios import parsed, smoke

from benchmark.control import plugins
from benchmark.control.state import TrafficState
from benchmark.records.record import Record
from benchmark.scenario.scenario import Scenario
from benchmark.study.episode import Episode, run_episode
from benchmark.study.episodes import all_episodes
from benchmark.study.pool import LocalPool

CHOSEN = all_episodes([smoke("asymmetric")], sorted(plugins.discovered()), [0.5], [3])
OTHERS = all_episodes(
    [smoke("tee"), smoke("asymmetric")], ["virtual-signal", "unsignalised"], [0.7], [4]
)
KRAUSS = parsed({"vehicles.car.car_following": {"model": "Krauss"}, "vehicles.car.share": 1.0})


@cache
def reference() -> dict[str, str]:
    """Each installed controller once, one after another in this process."""
    found = lines(map(run_episode, CHOSEN))
    assert len(found) == len(CHOSEN)
    assert all('"status":"ok"' in line or '"status":"skipped"' in line for line in found.values())
    return found


def test_again_in_one_process_in_another_order_after_other_episodes() -> None:
    first = reference()
    again = [
        record
        for one in reversed(CHOSEN)
        for record in (*map(run_episode, OTHERS[:1]), run_episode(one))
    ]
    assert lines(again).items() >= first.items()


@pytest.mark.parametrize("hash_seed", ["1", "2"])
def test_in_worker_processes_with_other_hash_seeds(
    monkeypatch: pytest.MonkeyPatch, hash_seed: str
) -> None:
    monkeypatch.setenv("PYTHONHASHSEED", hash_seed)  # the order of sets of texts depends on it
    order = [*OTHERS, *CHOSEN] if hash_seed == "1" else [*reversed(CHOSEN), *OTHERS]
    records = [record for _, record in LocalPool(int(hash_seed)).run(order)]
    found = lines(records)
    assert found.items() >= reference().items()


def test_drivers_with_imperfection_repeat_too_and_differ_by_seed() -> None:
    def once(seed: int) -> str:
        (line,) = lines([run_episode(Episode(KRAUSS, "first-come", 0.5, seed))]).values()
        return line

    assert once(1) == once(1)
    assert once(1).partition('"junctions"')[2] != once(2).partition('"junctions"')[2]


Driver = tuple[str, float, tuple[str, ...], float]
"""Class, speed factor, route, wanted departure [s]."""


def met(
    scenario: Scenario, controller: str, rate: float | None, seed: int = 3
) -> tuple[Record, dict[str, Driver], set[str]]:
    """The vehicles that a controller met as SUMO has them, and which of them are RVs."""
    drivers: dict[str, Driver] = {}
    robots: set[str] = set()
    api = libsumo.vehicle

    def look(state: TrafficState) -> None:
        for vehicle in state.vehicles:
            name = vehicle.id
            if name not in drivers:
                wanted = round(api.getDeparture(name) - api.getDepartDelay(name), 6)
                facts = (api.getTypeID(name), api.getSpeedFactor(name), api.getRoute(name), wanted)
                drivers[name] = facts
            if vehicle.is_robot:
                robots.add(name)

    record, _, _ = watched(Episode(scenario, controller, rate, seed), look)
    return record, drivers, robots


def test_every_controller_meets_the_same_vehicles() -> None:
    found = [met(one.scenario, one.controller, one.rate) for one in CHOSEN]
    ran = [record for record, *_ in found if record.status == "ok"]
    assert len({record.routes_hash for record in ran}) == 1
    networks = {(record.rules, record.network_hash) for record in ran}
    assert len(networks) == len({rules for rules, _ in networks})  # lit, dark, with stop signs
    everyone: dict[str, Driver] = {}
    for _, drivers, _ in found:
        for name, driver in drivers.items():
            assert everyone.setdefault(name, driver) == driver
    assert len(everyone) > 30
    shared = _shared(found)
    chosen = [robots & shared for _, _, robots in found if robots]
    assert all(one == chosen[0] != set() for one in chosen)


def _shared(found: list[tuple[Record, dict[str, Driver], set[str]]]) -> set[str]:
    """The vehicles that entered under every controller."""
    return set.intersection(*(set(drivers) for _, drivers, _ in found if drivers))


def test_a_higher_rate_only_adds_rvs_to_the_same_vehicles() -> None:
    found = [met(smoke("tee"), "virtual-signal", rate) for rate in (0.0, 0.2, 0.5, 0.8, 1.0)]
    assert len({one.routes_hash for one, *_ in found}) == 1
    shared = _shared(found)
    for (_, drivers, few), (_, more_drivers, many) in pairwise(found):
        assert all(drivers[name] == more_drivers[name] for name in shared)
        assert few & shared < many & shared
    assert found[0][2] == set()
    assert found[-1][2] >= shared


def test_another_seed_brings_other_vehicles_and_other_rvs() -> None:
    (one, drivers, robots), (other, others, other_robots) = (
        met(smoke("tee"), "virtual-signal", 0.5, seed) for seed in (3, 4)
    )
    assert one.routes_hash != other.routes_hash
    assert drivers != others
    assert robots != other_robots
