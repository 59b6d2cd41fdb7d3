"""What is committed, read once for all checks."""

import pytest
from factories.committed import RESULTS

from baselines.paper.samples import Samples
from benchmark.records import leaderboard, reference
from benchmark.records.record import Record
from benchmark.records.store import Store


@pytest.fixture(scope="session")
def records() -> list[Record]:
    return Store(RESULTS).read()


@pytest.fixture(scope="session")
def rows(records: list[Record]) -> list[leaderboard.Row]:
    return leaderboard.rows_of_records(records)


@pytest.fixture(scope="session")
def samples(records: list[Record]) -> Samples:
    return Samples(records)


def refuse(message: str) -> None:
    raise AssertionError(message)


@pytest.fixture(scope="session")
def shipped() -> reference.RegressionReference:
    return reference.read_reference(RESULTS / "reference", refuse)
