"""The page of methods: a formula for each figure, and the hash of the records."""

from factories.records import record

from benchmark.records.measures import MEASURES
from benchmark.reports.site import methods


def test_every_formula_is_one_that_browsers_show() -> None:
    assert all(methods.mathml(measure.formula).startswith("<math") for measure in MEASURES)


def test_the_hash_of_records_depends_on_neither_order_nor_wall_time() -> None:
    one, other = record("a", 1), record("a", 2)
    slower = other.model_copy(update={"wall_time": 9.0})
    assert methods.hash_of_records([one, other]) == methods.hash_of_records([slower, one])
    assert methods.hash_of_records([one]) != methods.hash_of_records([one, other])
