"""Texts from elsewhere on the site: sources, model cards, docstrings, replays."""

from pathlib import Path

from factories.scenarios import smoke

from benchmark.reports.site import citation, model_card
from benchmark.reports.site.replays import find

EVIL = "<img src=x onerror=alert(1)>"


def test_a_citation_names_title_sources_and_content() -> None:
    scenario = smoke("crossing").model_copy(
        update={"title": "50% of {A} & B_C", "sources": ("Counts: ours.", "Map ~ theirs")}
    )
    found = citation.entry(scenario, "1.0")
    assert found.startswith("@misc{rightofway-")
    assert r"title = {{50\% of \{A\} \& B\_C}}" in found
    assert rf"Counts: ours; Map \textasciitilde{{}} theirs; SHA-256 {scenario.hash}" in found
    assert found.count("{") == found.count("}")


def test_a_model_card_shows_its_markup_as_text_and_has_no_dead_links() -> None:
    found = model_card.render(
        f"# Card\n\n{EVIL} [here](other.md) [there](https://example.org/) "
        "[evil](javascript:alert(1)) ![picture](a.png)\n\n| a |\n|---|\n| b |\n"
    )
    assert "<h3>Card</h3>" in found
    assert "&lt;img" in found
    assert "<img" not in found
    assert found.count("<a ") == 1
    assert 'href="https://example.org/"' in found
    assert "here" in found
    assert "picture" in found
    assert '<div class="scroll"' in found


def test_installed_controllers_are_described_and_files_are_not_run(tmp_path: Path) -> None:
    known = model_card.describe("wang?x=1")
    assert known.brief.startswith("Wang")
    assert "Args:" not in known.words
    assert "Training seeds" in known.card
    trap = tmp_path / "trap.py"
    trap.write_text("raise SystemExit('run')")
    assert model_card.describe(f"{trap}:Trap") == model_card.Description()
    assert model_card.describe("nobody") == model_card.Description()


def test_replays_say_whom_they_show(tmp_path: Path) -> None:
    folder = tmp_path / "replays"
    folder.mkdir()
    (folder / "b.html").write_text(
        '<!doctype html><title>Two\n at once</title><meta name="rightofway:scenario" content="a/b">'
        '<meta name="rightofway:controller" content="x&amp;y">'
        '<meta name="rightofway:controller" content="z">'
    )
    (folder / "a.html").write_bytes(b"\xff\xfe no page at all")
    silent, one = find(tmp_path)
    assert (silent.title, silent.controllers) == ("a", ())
    assert (one.title, one.scenarios, one.controllers) == ("Two at once", ("a/b",), ("x&y", "z"))
    assert one.address == "replays/b.html"
    assert find(tmp_path / "nowhere") == []
