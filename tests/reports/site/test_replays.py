"""Replays beside the site say whom they show."""

from pathlib import Path

from benchmark.reports.site.replays import replays_in


def test_replays_say_whom_they_show(tmp_path: Path) -> None:
    folder = tmp_path / "replays"
    folder.mkdir()
    (folder / "b.html").write_text(
        '<!doctype html><title>Two\n at once</title><meta name="rightofway:scenario" content="a/b">'
        '<meta name="rightofway:controller" content="x&amp;y">'
        '<meta name="rightofway:episode" content="60 % RVs, seed 3">'
        '<meta name="rightofway:controller" content="z">'
    )
    (folder / "a.html").write_bytes(b"\xff\xfe no page at all")
    silent, one = replays_in(tmp_path)
    assert (silent.title, silent.controllers) == ("a", ())
    assert (one.title, one.scenarios, one.controllers) == ("Two at once", ("a/b",), ("x&y", "z"))
    assert (one.words, silent.words) == ("Two at once (60 % RVs, seed 3)", "a")
    assert one.address == "replays/b.html"
    assert replays_in(tmp_path / "nowhere") == []
