"""A manifest says all that it must, or is refused with its key."""

from typing import Any

import pytest

from benchmark.admission.submission import manifest
from benchmark.plumbing.errors import BundleError

MANIFEST: dict[str, Any] = {
    "format": 1,
    "name": "c",
    "authors": ["a"],
    "description": "d",
    "licence": "MIT",
    "code": {"source": "c 1", "place": "c:C", "sha256": "0" * 64, "included": False},
    "versions": {"rightofway": "1", "sumo": "1", "python": "3"},
    "files": {"records/a.jsonl": "0" * 64},
}


@pytest.mark.parametrize("key", list(MANIFEST))
def test_a_key_that_is_missing_in_the_manifest_is_named(key: str) -> None:
    manifest.parse(MANIFEST)
    with pytest.raises(BundleError, match=f"manifest.toml: {key}: this key is required"):
        manifest.parse({name: one for name, one in MANIFEST.items() if name != key})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"lisence": "MIT"}, 'unknown key "lisence"; did you mean "licence"?'),
        ({"format": 2}, "format: should be 1"),
        ({"authors": []}, "authors"),
        ({"name": "c\n[x]"}, "is no reference to a controller"),
        ({"files": {"../a": "0" * 64}}, "leads out of its folder"),
        ({"files": {"a": "no hash"}}, "files.a"),
        ({"options": {"weights": "/etc/passwd"}}, "is absolute"),
        ({"code": MANIFEST["code"] | {"source": "../../x 1"}}, "code.source"),
        ({"code": MANIFEST["code"] | {"place": "a:b\n[c]"}}, "code.place"),
    ],
)
def test_a_manifest_that_makes_no_sense_is_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(BundleError) as caught:
        manifest.parse(MANIFEST | changes)
    assert said in str(caught.value)
