"""How long the results site takes: ``pytest tests/benchmarks -k site --benchmark-enable``."""

from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from benchmark.records.store import Store
from benchmark.reports.site.build import build_site
from benchmark.reports.site.contents import Contents

RESULTS = Path(__file__).parents[2] / "results"
LIMIT = 30.0  # s


def test_the_site_of_the_results(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    if benchmark.disabled:
        pytest.skip("benchmarks are disabled; see the top of the file")

    def make() -> None:
        build_site(Contents.of(Store(RESULTS).read()), tmp_path / "site")

    benchmark.pedantic(make, rounds=1)  # a second one would find its intervals worked out
    assert benchmark.stats.stats.min < LIMIT
