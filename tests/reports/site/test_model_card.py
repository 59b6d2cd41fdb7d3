"""Model cards and docstrings on the site: text from elsewhere shows as text."""

from pathlib import Path

from benchmark.reports.site import model_card

EVIL = "<img src=x onerror=alert(1)>"


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
