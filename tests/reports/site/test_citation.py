"""A citation names title, sources and content."""

from factories.scenarios import smoke

from benchmark.reports.site import citation


def test_a_citation_names_title_sources_and_content() -> None:
    scenario = smoke("crossing").model_copy(
        update={"title": "50% of {A} & B_C", "sources": ("Counts: ours.", "Map ~ theirs")}
    )
    found = citation.bibtex_entry(scenario, "1.0")
    assert found.startswith("@misc{rightofway-")
    assert r"title = {{50\% of \{A\} \& B\_C}}" in found
    assert rf"Counts: ours; Map \textasciitilde{{}} theirs; SHA-256 {scenario.hash}" in found
    assert found.count("{") == found.count("}")
