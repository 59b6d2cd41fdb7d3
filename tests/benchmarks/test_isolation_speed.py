"""What isolation costs: ``pytest tests/benchmarks -k isolated --benchmark-enable -s``."""

from collections.abc import Iterator, Mapping

import pytest
from factories.scenarios import smoke
from factories.traffic import CROSSROADS, crossing, state, vehicle
from pytest_benchmark.fixture import BenchmarkFixture

from benchmark.control import plugins
from benchmark.control.controller import Command
from benchmark.control.guard import Guard
from benchmark.control.isolation.limits import DEFAULT
from benchmark.control.isolation.remote import Remote
from benchmark.control.state import TrafficState

CONTROLLER = "first-come"  # says Go to every RV that decides: as many commands as there can be
LIMIT = 1e-3  # s
MOVEMENTS = CROSSROADS.regulated_movements
BUSY: TrafficState = state(
    *(
        vehicle(f"flow.{n}", MOVEMENTS[n % len(MOVEMENTS)], speed=n / 7, distance=1 + n / 7)
        for n in range(100)
    ),
    *(crossing(name=f"inside.{n}", cell=n) for n in range(10)),
)


@pytest.fixture(autouse=True)
def _only_when_measuring(benchmark: BenchmarkFixture) -> None:
    if benchmark.disabled:
        pytest.skip("benchmarks are disabled; see the top of the file")


class Commands:
    """Rules that take the commands as they come."""

    def decide(self, state: TrafficState, commands: Mapping[str, Command]) -> Mapping[str, Command]:
        return commands


@pytest.fixture
def remote() -> Iterator[Remote]:
    with Remote(CONTROLLER, DEFAULT) as found:
        yield found


def test_an_isolated_step_with_a_hundred_vehicles(
    benchmark: BenchmarkFixture, remote: Remote
) -> None:
    here, apart = (
        Guard(plugins.find_controller(CONTROLLER), smoke("tee")),
        remote.decider(smoke("tee")),
    )
    for guard in (here, apart):
        guard.reset({"intersection": CROSSROADS}, 1)
    rules = Commands()
    commands = here.act("intersection", BUSY, rules)
    assert len(commands) == 100
    assert apart.act("intersection", BUSY, rules) == commands
    benchmark.pedantic(
        apart.act, args=("intersection", BUSY, rules), rounds=20, iterations=100, warmup_rounds=2
    )
    assert benchmark.stats is not None
    fastest, mean = benchmark.stats.stats.min, benchmark.stats.stats.mean
    print(f"isolated step: {1e3 * fastest:.2f} ms, mean {1e3 * mean:.2f} ms")  # noqa: T201
    assert fastest < LIMIT


def test_an_isolated_process_starts(benchmark: BenchmarkFixture) -> None:
    def start() -> None:
        with Remote(CONTROLLER, DEFAULT):
            pass

    benchmark.pedantic(start, rounds=9)
    assert benchmark.stats is not None
    print(f"isolated start: {benchmark.stats.stats.min:.2f} s")  # noqa: T201
    assert benchmark.stats.stats.min < 1.0
