"""Lane changes that regulate a lane: found, judged by how long, and drawn as they were."""

from pathlib import Path

import pytest
from factories.scenarios import DROP, parsed, shipped, smoke
from factories.traffic import CROSSROADS, state, vehicle
from matplotlib.image import imread
from plugins import install

from baselines.paper import lane_change, lane_change_drawing
from baselines.paper.lane_change import LaneChange, Search, first_asked_for, longest, words
from benchmark.control import plugins
from benchmark.control.state import TrafficState, Vehicle
from benchmark.plumbing.errors import ControllerError
from benchmark.study.episode import Episode

KERB, CENTRE = CROSSROADS.movements["N-C"].lanes  # northbound_1 and northbound_2


def on(lane: str, name: str = "rv", **facts: object) -> Vehicle:
    return vehicle(name, lane=lane, **facts)


def search(
    *steps: list[Vehicle], asked: dict[int, dict[str, int]] | None = None
) -> list[LaneChange]:
    """The lane changes of an episode with this traffic, a step each second from 1 s on."""
    found = Search()
    for time, vehicles in enumerate(steps, start=1):
        found.see(state(*vehicles, time=float(time)), (asked or {}).get(time, {}))
    return found.finish()


BEFORE = [on(KERB), on(KERB, "other")]
AFTER = [on(CENTRE), on(KERB, "other")]


def test_an_rv_that_leaves_another_for_an_empty_lane_is_found() -> None:
    (one,) = search(BEFORE, AFTER, AFTER, [on(KERB, "other")])
    assert (one.vehicle, one.source, one.target) == ("rv", KERB, CENTRE)
    assert (one.before.time, one.after.time, one.until) == (1.0, 2.0, 4.0)
    assert one.duration == 2.0
    assert not one.told


def test_a_lane_that_other_rvs_go_on_to_regulate_stays_regulated() -> None:
    follows = [on(CENTRE, "third"), on(KERB, "other")]
    (one,) = search(BEFORE, AFTER, [*AFTER, on(CENTRE, "third")], follows, follows)
    assert one.until == 5.0  # the last step


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ([on(KERB)], [on(CENTRE)]),  # it leaves a lane unregulated
        (BEFORE, [on(CENTRE)]),  # the other has gone meanwhile
        ([on(KERB)], AFTER),  # the other has come only now
        ([*BEFORE, on(CENTRE, "third")], [*AFTER, on(CENTRE, "third")]),  # it is regulated
        (BEFORE, [*AFTER, on(CENTRE, "third")]),  # another regulates it as well
        (BEFORE, BEFORE),
        ([on(KERB, "other")], AFTER),  # it has come from elsewhere
        ([on(KERB, is_robot=False), on(KERB, "other")], [on(CENTRE, is_robot=False), *BEFORE[1:]]),
        ([on("northbound_0"), on("northbound_0", "o")], [on(KERB), on("northbound_0", "o")]),
        ([on("upstream_0"), on("upstream_0", "o")], [on(KERB), on("upstream_0", "o")]),
    ],
)
def test_other_changes_are_none(before: list[Vehicle], after: list[Vehicle]) -> None:
    assert search(before, after, after) == []


def test_hvs_regulate_nothing() -> None:
    human = on(CENTRE, "hv", is_robot=False)
    assert len(search([*BEFORE, human], [*AFTER, human])) == 1


@pytest.mark.parametrize(("index", "told"), [(2, True), (0, False)])
def test_a_change_that_was_asked_for_is_told_from_one_by_itself(index: int, told: bool) -> None:
    (one,) = search(BEFORE, AFTER, asked={2: {"rv": index}})
    assert one.told == told


def test_a_lane_can_be_regulated_more_than_once() -> None:
    found = search(BEFORE, AFTER, BEFORE, AFTER, AFTER)
    assert [(one.after.time, one.until) for one in found] == [(2.0, 3.0), (4.0, 5.0)]


def change(duration: float, told: bool = False) -> LaneChange:
    start: TrafficState = state(*AFTER, time=10.0)
    before = state(*BEFORE, time=9.0)
    return LaneChange("rv", KERB, CENTRE, told, before, start, 10.0 + duration)


def test_the_longest_is_chosen_and_one_that_was_asked_for_before_all_others() -> None:
    short, long = change(3.0), change(30.0)
    assert longest([short, long, change(20.0)]) is long
    assert longest([short, long, asked := change(1.0, told=True)]) is asked


def test_words_name_scenario_rate_seed_time_and_vehicle() -> None:
    episode = Episode(smoke("crossing"), "wang", 0.4, 7)
    text = words(episode, [change(3.0), change(30.0)])
    assert text.startswith(
        "At 10 s of smoke/crossing at 40 % RVs, seed 7, under `wang`, the RV `rv`"
    )
    assert f"`{KERB}`" in text
    assert f"`{CENTRE}`" in text
    assert "it did so by itself" in text
    assert "for 30 s" in text
    assert "2 RVs changed lanes so, 0 of them" in text


def test_where_every_leg_has_one_lane_there_is_none() -> None:
    episodes = (Episode(smoke("crossing"), "first-come", 0.5, seed) for seed in (1, 2))
    assert first_asked_for(episodes) is None


def test_a_controller_that_fails_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(install(tmp_path / "hostile"))
    plugins.discovered.cache_clear()
    try:
        with pytest.raises(ControllerError, match="raises-in-act on smoke/tee: act at 10 s raised"):
            lane_change.in_episode(Episode(smoke("tee"), "raises-in-act", 0.5, 1))
    finally:
        plugins.discovered.cache_clear()


def test_a_controller_that_refuses_the_scenario_is_named_with_its_reason() -> None:
    without_signal = parsed({"signal": DROP})
    with pytest.raises(ControllerError, match=r"traffic-light on test/a: .*signal"):
        lane_change.in_episode(Episode(without_signal, "traffic-light", None, 1))


@pytest.fixture(scope="module")
def real() -> tuple[Episode, list[LaneChange]]:
    """The lane changes of RVs that spread over lanes, in one short episode."""
    whole = shipped("colorado-springs/334")
    evaluation = whole.evaluation.model_copy(update={"duration": 200.0, "warm_up": 0.0})
    scenario = whole.model_copy(update={"evaluation": evaluation})
    found = first_asked_for([Episode(scenario, "time-windows", 0.4, 1)])
    assert found is not None
    return found


def test_rvs_that_spread_over_lanes_regulate_some(real: tuple[Episode, list[LaneChange]]) -> None:
    for one in real[1]:
        assert one.target in one.before.unregulated_lanes
        assert one.target not in one.after.unregulated_lanes
        assert one.source not in one.after.unregulated_lanes
        assert one.duration >= 0
    assert longest(real[1]).told


def test_the_drawing_shows_rvs_hvs_and_the_lane_and_is_the_same_bytes_again(
    real: tuple[Episode, list[LaneChange]], tmp_path: Path
) -> None:
    one = longest(real[1])
    files = [tmp_path / "a.png", tmp_path / "b.png"]
    for file in files:
        lane_change_drawing.draw(real[0].scenario, one, file)
    assert files[0].read_bytes() == files[1].read_bytes()
    image = imread(files[0])[..., :3]
    for colour in (lane_change_drawing.ROBOT, lane_change_drawing.HUMAN, lane_change_drawing.LANE):
        wanted = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        assert (abs(image - wanted).max(axis=2) < 0.01).sum() > 100, colour
