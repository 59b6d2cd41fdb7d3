"""A regression check as JSON, for programs; the models are its schema."""

from typing import Literal

from pydantic import Field

from benchmark.plumbing.models import Entry
from benchmark.records.provenance import Provenance
from benchmark.records.regression import Comparison, Row, Verdict


class Interval(Entry):
    """A mean difference, paired by seed, with its 95 % interval."""

    mean: float
    low: float | None = Field(description="null for a single seed")
    high: float | None


class ReportRow(Entry):
    """One figure of one controller on one scenario at one rate."""

    verdict: Verdict
    scenario: str
    controller: str
    rate: float | None = Field(description="null stands for every rate")
    metric: str
    unit: str
    more_is_better: bool
    reference: float | None = Field(description="mean over the paired seeds")
    new: float | None = Field(description="mean over the paired seeds")
    ratio: float | None = Field(description="new over reference")
    difference: Interval | None = Field(description="new minus reference")
    seeds: int = Field(description="pairs")
    remark: str


class Report(Entry):
    """A whole regression check."""

    schema_: Literal[1] = Field(1, alias="schema", description="version of this format")
    exit_code: Literal[0, 1, 2]
    limit: float = Field(description="as a share")
    counts: dict[str, int] = Field(description="rows by verdict")
    reference: Provenance | None
    rows: tuple[ReportRow, ...]


def as_json(comparison: Comparison, made: Provenance | None) -> str:
    """The report as text that ends in a newline."""
    report = Report.model_validate(
        {
            "exit_code": comparison.exit_code,
            "limit": comparison.limit,
            "counts": {str(verdict): count for verdict, count in comparison.counts().items()},
            "reference": made,
            "rows": tuple(map(_row, comparison.rows)),
        }
    )
    return report.model_dump_json(by_alias=True, indent=1) + "\n"


def _row(row: Row) -> ReportRow:
    found = row.difference
    return ReportRow(
        verdict=row.verdict,
        scenario=row.scenario,
        controller=row.controller,
        rate=row.rate,
        metric=row.column.key,
        unit=row.column.unit,
        more_is_better=row.column.more_is_better,
        reference=row.reference,
        new=row.new,
        ratio=row.ratio,
        difference=Interval(mean=found.mean, low=found.low, high=found.high) if found else None,
        seeds=row.seeds,
        remark=row.remark,
    )
