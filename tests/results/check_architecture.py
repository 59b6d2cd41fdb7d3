"""The picture of the architecture comes out of the imports again, their numbers too."""

from pathlib import Path

from architecture import PICTURE, arrows, draw, floors


def test_the_picture_is_drawn_from_the_imports_as_they_are(tmp_path: Path) -> None:
    draw(floors(), arrows(), tmp_path / PICTURE.name)
    drawn, committed = (path.read_bytes() for path in (tmp_path / PICTURE.name, PICTURE))
    assert drawn == committed, "draw it again with `make architecture`"
