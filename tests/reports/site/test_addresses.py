"""Names of files on the site: plain, different, and like the names of what they show."""

from hypothesis import given
from hypothesis import strategies as st

from benchmark.reports.site.addresses import slugs


@given(st.sets(st.text(max_size=100), max_size=8))
def test_file_names_are_plain_and_differ_whatever_the_names(names: set[str]) -> None:
    found = slugs(names)
    assert found.keys() == names
    lower = [slug.lower() for slug in found.values()]
    assert len(set(lower)) == len(lower)
    for slug in found.values():
        assert 0 < len(slug.encode()) <= 100
        assert set(slug) <= set("abcdefghijklmnopqrstuvwxyz0123456789._-")
        assert not slug.startswith(".")


def test_file_names_follow_the_names() -> None:
    found = slugs(["colorado-springs/229", "virtual-signal?green=15", "A", "a", "../../etc/passwd"])
    assert found["colorado-springs/229"] == "colorado-springs-229"
    assert found["virtual-signal?green=15"] == "virtual-signal-green-15"
    assert found["../../etc/passwd"] == "etc-passwd"
    assert found["A"].startswith("a-")
