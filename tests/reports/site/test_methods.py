"""The page of methods: a formula for each figure, and the hash of the records."""

from factories.records import record

from benchmark.records.formulas import FORMULAS
from benchmark.records.measures import COLUMNS
from benchmark.reports.site import methods


def test_every_column_of_the_leaderboard_has_a_formula() -> None:
    assert FORMULAS.keys() == {column.key for column in COLUMNS}
    assert all(metric.formula.startswith("<math") for metric in methods.metrics())


def test_the_hash_of_records_depends_on_neither_order_nor_wall_time() -> None:
    one, other = record("a", 1), record("a", 2)
    slower = other.model_copy(update={"wall_time": 9.0})
    assert methods.records_hash([one, other]) == methods.records_hash([slower, one])
    assert methods.records_hash([one]) != methods.records_hash([one, other])
