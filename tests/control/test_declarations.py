"""What controllers declare that they need: checked when found, and reasons to be skipped."""

from typing import Any

import pytest
from factories.scenarios import network_of, smoke

from baselines.traffic_light import TrafficLight
from baselines.virtual_signal import VirtualSignal
from benchmark.control import declarations, plugins
from benchmark.control.declarations import Declaration
from benchmark.plumbing.errors import ControllerError
from benchmark.study.episode import Episode, run_episode


def kind(base: type = VirtualSignal, **declared: Any) -> Any:
    return type("Needy", (base,), declared)


@pytest.mark.parametrize(
    ("declared", "scenario", "rate", "reason"),
    [
        ({}, "tee", 0.0, None),
        ({"rates": (0.4, 1)}, "tee", 0.4, None),
        ({"rates": (0.4, 0.8)}, "tee", 0.8, None),
        ({"rates": (0.4, 1)}, "tee", 0.39, "it needs 40 to 100 % RVs, and the rate is 39 %"),
        ({"rates": (0, 0.625)}, "tee", 1.0, "it needs 0 to 62.5 % RVs, and the rate is 100 %"),
        ({"rates": (0.4, 1)}, "tee", None, None),
        ({"approaches": {3, 4}}, "tee", 0.5, None),
        ({"approaches": {4}}, "crossing", 0.5, None),
        ({"approaches": [4]}, "tee", 0.5, "it needs 4 approaches, and the scenario has 3"),
        ({"approaches": {6, 5}}, "tee", 0.5, "it needs 5 or 6 approaches, and the scenario has 3"),
    ],
)
def test_a_scenario_or_rate_it_is_not_made_for_is_a_reason_to_skip(
    declared: dict[str, Any], scenario: str, rate: float | None, reason: str | None
) -> None:
    intersections = network_of(f"smoke/{scenario}").intersections
    assert Declaration.of("needy", kind(**declared)).unmet(intersections, rate) == reason


def test_a_skipped_episode_does_not_even_make_the_controller(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(self: object) -> None:
        raise AssertionError("made")

    found = kind(approaches={4}, __init__=refuse)
    monkeypatch.setattr(plugins, "load_class", lambda name: found)
    records = {
        one: run_episode(Episode(smoke(one), "needy", 0.5, 1)) for one in ("tee", "crossing")
    }
    assert records["tee"].status == "skipped"
    assert records["tee"].reason == "it needs 4 approaches, and the scenario has 3"
    assert (records["tee"].rules, records["tee"].trips) == ("robot vehicles", None)
    assert records["crossing"].status == "failed"


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ({"rates": 0.4}, "rates = 0.4; expected the least and the greatest, as in (0.4, 1.0)"),
        ({"rates": (0.4,)}, "rates = (0.4,)"),
        ({"rates": (0.8, 0.4)}, "rates = (0.8, 0.4)"),
        ({"rates": (40, 100)}, "rates = (40, 100)"),
        ({"rates": ("0", "1")}, "rates = ('0', '1')"),
        ({"rates": (0, float("nan"))}, "rates = (0, nan)"),
        ({"approaches": 4}, "approaches = 4; expected whole numbers, as in {3, 4}"),
        ({"approaches": ()}, "approaches = ()"),
        ({"approaches": "34"}, "approaches = '34'"),
        ({"approaches": {4.0}}, "approaches = {4.0}"),
        ({"arbitration": "mine"}, 'arbitration = \'mine\'; expected "flexible" or "own"'),
    ],
)
def test_a_declaration_that_makes_no_sense_is_refused_when_the_controller_is_found(
    monkeypatch: pytest.MonkeyPatch, declared: dict[str, Any], message: str
) -> None:
    assert message in str(declarations.mistake(kind(**declared)))
    monkeypatch.setitem(globals(), "Needy", kind(**declared))
    with pytest.raises(ControllerError) as caught:
        plugins.find_controller(f"{__name__}:Needy")
    assert str(caught.value).startswith(f'controller "{__name__}:Needy": {message}')


def test_what_is_declared_is_said_in_words() -> None:
    wanted = "lights dark, own arbitration; 40 to 100 % RVs; 3 or 4 approaches"
    needy = kind(arbitration="own", rates=(0.4, 1), approaches={4, 3})
    assert Declaration.of("needy", needy).in_words() == wanted
    wanted = "lights on; commands no vehicle; any number of approaches"
    assert Declaration.of("needy", kind(TrafficLight)).in_words() == wanted
