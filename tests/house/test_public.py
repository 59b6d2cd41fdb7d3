"""What ``import benchmark`` gives: a short list, imported when it is used."""

import ast
import subprocess
import sys

import pytest
from factories.processes import PATIENCE
from factories.scenarios import ROOT

import benchmark
from benchmark import Record, RightOfWayError, find_scenario, run

HEAVY = {"libsumo", "sumolib", "polars", "matplotlib", "scipy", "torch", "gymnasium", "typer"}


def listed() -> list[str]:
    """The names in the stub."""
    tree = ast.parse((ROOT / "benchmark" / "__init__.pyi").read_text())
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    return [alias.name for node in imports for alias in node.names]


def test_every_public_name_is_there() -> None:
    names = listed()
    assert len(names) > 20
    assert set(names) <= set(dir(benchmark))
    assert all(getattr(benchmark, name).__name__ == name for name in names if name != "Command")


def test_importing_the_package_imports_nothing_heavy() -> None:
    lines = ["import sys, benchmark", f"print(sorted(set(sys.modules) & {HEAVY!r}))"]
    lines[1:1] = ["from benchmark import Controller, Go, Intersection, TrafficState, Training"]
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)],
        capture_output=True,
        text=True,
        check=True,
        timeout=PATIENCE,
    )
    assert done.stdout.strip() == "[]"


def test_one_line_gives_a_record() -> None:
    record = run("smoke/tee", "virtual-signal", rate=0.6, seed=1)
    assert isinstance(record, Record)
    assert (record.status, record.rate, record.seed) == ("ok", 0.6, 1)
    assert record == run(find_scenario("smoke/tee"), "virtual-signal", 0.6).model_copy(
        update={"wall_time": record.wall_time}
    )


def test_a_controller_that_commands_no_vehicle_has_no_rate() -> None:
    assert run("smoke/tee", "traffic-light", rate=0.6).rate is None


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"controller": "virtual-signal"}, "virtual-signal commands RVs: say at which rate"),
        ({"controller": "virtual-signal", "rate": 60}, "rate = 60: expected a share from 0 to 1"),
        ({"controller": "virtual-signl", "rate": 0.6}, 'did you mean "virtual-signal"'),
        ({"scenario": "smoke", "controller": "traffic-light"}, "names 3 scenarios"),
    ],
)
def test_a_mistake_is_refused_in_one_line(arguments: dict[str, object], said: str) -> None:
    with pytest.raises(RightOfWayError, match=said):
        run(**{"scenario": "smoke/tee", **arguments})  # type: ignore[arg-type]
