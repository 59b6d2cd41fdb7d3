"""Each figure is defined once, and what others say of it agrees."""

import re

from factories.scenarios import ROOT
from pydantic import BaseModel

from benchmark.records.measures import BY_KEY, HEADLINE, MEASURES, Measure
from benchmark.records.record import JunctionMetrics, TripMetrics, Waiting


def field_of(measure: Measure) -> tuple[type[BaseModel], str]:
    """The model and the field that hold it."""
    part, name, *inner = measure.place.split(".")
    model = {"junctions": JunctionMetrics, "trips": TripMetrics}[part]
    assert name in model.model_fields
    return (Waiting, inner[0]) if inner else (model, name)


def test_every_figure_has_its_place_and_unit_in_the_record() -> None:
    assert len(BY_KEY) == len(MEASURES) == len({measure.place for measure in MEASURES})
    for measure in MEASURES:
        model, name = field_of(measure)
        unit = re.search(r"\[(.*)\]", model.model_fields[name].description or "")
        assert (unit[1] if unit else "") == measure.unit.replace("share", "")


def test_the_headline_is_the_papers_waiting_time() -> None:
    assert HEADLINE.key == "average_waiting_time"


def test_the_page_of_methods_says_what_the_measures_say() -> None:
    lines = (ROOT / "docs" / "methods.md").read_text("utf-8").splitlines()
    start = lines.index("| measure | unit | definition |") + 2
    rows = [f"| {measure.title} | {measure.unit} | {measure.words} |" for measure in MEASURES]
    assert lines[start : start + len(rows)] == rows
