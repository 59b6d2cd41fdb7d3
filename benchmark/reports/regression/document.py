"""A regression check as JSON, for programs; the models are its schema."""

from typing import Literal

from pydantic import Field

from benchmark.plumbing.models import Entry
from benchmark.records.provenance import Provenance
from benchmark.records.regression import Finding, RegressionCheck, Verdict


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


def regression_json(check: RegressionCheck, made: Provenance | None) -> str:
    """The report as text that ends in a newline."""
    report = Report.model_validate(
        {
            "exit_code": check.exit_code,
            "limit": check.limit,
            "counts": {str(verdict): count for verdict, count in check.counts().items()},
            "reference": made,
            "rows": tuple(map(_row, check.findings)),
        }
    )
    return report.model_dump_json(by_alias=True, indent=1) + "\n"


def _row(finding: Finding) -> ReportRow:
    difference = finding.difference
    return ReportRow(
        verdict=finding.verdict,
        scenario=finding.scenario,
        controller=finding.controller,
        rate=finding.rate,
        metric=finding.measure.key,
        unit=finding.measure.unit,
        more_is_better=finding.measure.more_is_better,
        reference=finding.reference,
        new=finding.new,
        ratio=finding.ratio,
        difference=Interval(mean=difference.mean, low=difference.low, high=difference.high)
        if difference
        else None,
        seeds=finding.seeds,
        remark=finding.remark,
    )
