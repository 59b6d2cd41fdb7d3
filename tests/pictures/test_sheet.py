"""Drawings of scenarios: files that hold what the scenario says, byte for byte again."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest
from factories.scenarios import ROOT
from factories.scenarios import parsed as changed_crossing
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.image import imread

from benchmark.pictures import axes, geometry
from benchmark.pictures.sheet import signal_program, whole
from benchmark.plumbing.errors import UsageError
from benchmark.scenario import scenario
from benchmark.scenario.demand import busiest
from benchmark.sumo import ground, network

SMOKE = ROOT / "scenarios" / "smoke"


def document(name: str) -> dict[str, Any]:
    return tomllib.loads((SMOKE / f"{name}.toml").read_text())


def drawn_words(target: Path) -> list[str]:
    root = ElementTree.parse(target).getroot()
    return [text.text or "" for text in root.iter("{http://www.w3.org/2000/svg}text")]


def scene_of(name: str) -> axes.Scene:
    loaded = scenario.load_scenario(SMOKE / f"{name}.toml")
    built = network.build_network(loaded)
    junction = next(iter(built.junctions.values()))
    return axes.Scene(loaded, junction, ground.surroundings(built))


def test_the_panels_of_a_page_hold_plan_and_counts_each_by_itself() -> None:
    crossing = scenario.load_scenario(SMOKE / "crossing.toml")
    panels = whole.panels(crossing)
    words = {
        name: "".join(ElementTree.fromstring(text).itertext()) for name, text in panels.items()
    }
    assert "northbound (N)" in words["plan"]
    assert f"N-C  {busiest(crossing.demand).northbound.cross:.0f}" in words["counts"]
    assert "northbound" not in words["counts"]
    assert whole.panels(crossing) == panels


@pytest.mark.parametrize(
    "name",
    [
        *("asymmetric", "crossing"),
        pytest.param("tee", marks=pytest.mark.slow),
    ],
)
def test_each_smoke_scenario_shows_its_approaches_counts_and_cycle(
    name: str, tmp_path: Path
) -> None:
    loaded = scenario.load_scenario(SMOKE / f"{name}.toml")
    whole.draw(loaded, target := tmp_path / "drawing.svg")
    words = drawn_words(target)
    assert any("longest" in word for word in words) is (name == "asymmetric")  # it is actuated
    assert loaded.title in words
    assert all(any(name in word for word in words) for name in loaded.approaches.names())
    assert loaded.signal is not None
    assert any(f"{loaded.signal.cycle:g} s" in word for word in words)
    counts = {flow.movement: flow.volume for flow in scene_of(name).flows}
    assert {f"{name}  {volume:.0f}" for name, volume in counts.items()} <= set(words)


def test_a_png_has_asphalt_and_every_approach_in_its_colour_and_leaves_matplotlib_alone(
    tmp_path: Path,
) -> None:
    before = dict(matplotlib.rcParams)
    whole.draw(
        scenario.load_scenario(SMOKE / "crossing.toml"), target := tmp_path / "new" / "drawing.PNG"
    )
    assert dict(matplotlib.rcParams) == before
    image = imread(target, format="png")
    assert image.shape[0] > 1000
    assert image.shape[1] > 1000
    for colour in (axes.ASPHALT, *axes.COLOURS):
        near = np.abs(image[..., :3] - np.array(matplotlib.colors.to_rgb(colour))).max(axis=2)
        assert (near < 0.01).sum() > 500, colour


@pytest.mark.parametrize("suffix", ["svg", pytest.param("png", marks=pytest.mark.slow)])
def test_the_same_scenario_gives_the_same_bytes(tmp_path: Path, suffix: str) -> None:
    targets = [tmp_path / f"{number}.{suffix}" for number in range(2)]
    for target in targets:
        whole.draw(scenario.load_scenario(SMOKE / "tee.toml"), target)
    assert targets[0].read_bytes() == targets[1].read_bytes()


@pytest.mark.parametrize("name", ["drawing.pdf", "drawing"])
def test_an_unknown_suffix_is_refused_with_the_choices(name: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"use \.png or \.svg") as caught:
        whole.draw(scenario.load_scenario(SMOKE / "crossing.toml"), tmp_path / name)
    assert f'"{Path(name).suffix}"' in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_a_file_that_cannot_be_written_is_an_error_with_its_name(tmp_path: Path) -> None:
    (tmp_path / "taken.svg").mkdir()
    with pytest.raises(UsageError, match=r"taken\.svg: cannot write"):
        whole.draw(scenario.load_scenario(SMOKE / "crossing.toml"), tmp_path / "taken.svg")


def test_words_of_a_scenario_show_literally(tmp_path: Path) -> None:
    odd = document("crossing") | {
        "title": "a $x_1$ <script>alert(1)</script> \\frac{ \u0007 \u4ea4\u5dee\u70b9 & b",
        "sources": ["counts: $y^", "map: <b>\n"],
    }
    parsed = scenario.parse_scenario(odd, source="odd.toml", name="odd/odd")
    whole.draw(parsed, target := tmp_path / "drawing.svg")
    words = drawn_words(target)
    assert "a $x_1$ <script>alert(1)</script> \\frac{ \u4ea4\u5dee\u70b9 & b" in words
    assert any("counts: $y^; map: <b>" in word for word in words)
    assert "<script" not in target.read_text()


def test_a_scenario_without_signal_says_so(tmp_path: Path) -> None:
    bare = {key: value for key, value in document("crossing").items() if key != "signal"}
    parsed = scenario.parse_scenario(bare, source="bare.toml", name="bare/bare")
    whole.draw(parsed, target := tmp_path / "drawing.svg")
    words = drawn_words(target)
    assert any("no signal" in word for word in words)
    assert not any("phase" in word for word in words)


def test_every_junction_is_drawn_with_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    crossing = scenario.load_scenario(SMOKE / "crossing.toml")
    built = network.build_network(crossing)
    (junction,) = built.junctions.values()
    junctions = {
        name: replace(junction, intersection=replace(junction.intersection, id=name))
        for name in ("west", "east")
    }
    monkeypatch.setattr(network, "build_network", lambda _: replace(built, junctions=junctions))
    whole.draw(crossing, target := tmp_path / "drawing.svg")
    words = drawn_words(target)
    assert {f"Plan, lanes and zones of {name}" for name in junctions} <= set(words)
    assert words.count("northbound (N)") == 2
    panels = whole.panels(crossing)
    assert "".join(ElementTree.fromstring(panels["plan"]).itertext()).count("northbound (N)") == 2


def test_a_green_that_goes_on_has_no_yellow_between_phases() -> None:
    signal = scenario.load_scenario(SMOKE / "tee.toml").signal
    assert signal is not None
    through = [light for _, _, light in signal_program.lights(signal, "W-C")]
    assert through == ["green", "green", "yellow", "all red"]
    alone = list(signal_program.lights(signal, "N-L"))
    assert alone == [(36.0, 10.0, "green"), (46.0, 3.0, "yellow"), (49.0, 1.0, "all red")]


def test_a_right_turn_that_a_phase_names_has_a_row_and_no_turn_on_red_is_said(
    tmp_path: Path,
) -> None:
    changes = {
        "signal.phases.2": {"movements": ["E-L", "W-L", "N-R"], "green": 10},
        "approaches.northbound.right_on_red": False,
    }
    whole.draw(changed_crossing(changes), target := tmp_path / "drawing.svg")
    words = drawn_words(target)
    assert words.count("N-R") == 1 + drawn_before(tmp_path).count("N-R")
    assert "No turn on red: northbound." in words


def drawn_before(folder: Path) -> list[str]:
    """The words of the drawing of the unchanged crossing."""
    whole.draw(changed_crossing(), target := folder / "before.svg")
    return drawn_words(target)


def test_flows_are_as_wide_as_their_counts_and_begin_and_end_on_their_roads() -> None:
    scene = scene_of("asymmetric")
    ratios = [flow.width / flow.volume for flow in scene.flows]
    assert ratios == pytest.approx([ratios[0]] * len(ratios))
    for flow in scene.flows:
        leaves = scene.exits[scene.intersection.movements[flow.movement].exit]
        assert abs(scene.entrances[flow.approach].beside(flow.line[0])) < 8
        assert abs(leaves.beside(flow.line[-1])) < 8
        assert (flow.line[-1] - flow.line[-2]) @ leaves.ahead > 0


def test_surroundings_hold_the_roads_that_leave_as_well_as_those_that_enter() -> None:
    scene = scene_of("tee")
    ways = [way for one in scene.intersection.movements.values() for way in one.ways]
    for way in ways:
        assert scene.ground.lanes[way.lane].shape[-1] == way.shape[0]
        assert scene.ground.lanes[way.exit_lane].shape[0] == way.shape[-1]
    assert any(lane.inside for lane in scene.ground.lanes.values())
    assert scene.ground.areas


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(0.1, 10)), min_size=1, max_size=8))
def test_things_in_a_row_never_overlap(things: list[tuple[float, float]]) -> None:
    wanted, sizes = zip(*things, strict=True)
    centres = axes.spread(wanted, sizes)
    for index in range(len(centres) - 1):
        needed = (sizes[index] + sizes[index + 1]) / 2
        assert centres[index + 1] - centres[index] >= needed - 1e-6


def test_a_stretch_is_measured_from_the_end_of_a_line() -> None:
    line = geometry.points([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)])
    part = geometry.stretch(line, near=5.0, far=12.0)
    assert part is not None
    assert part.tolist() == [[8.0, 0.0], [10.0, 0.0], [10.0, 5.0]]
    assert geometry.stretch(line, near=20.0, far=30.0) is None
