"""Does it keep to the contract, and does it do what it is for?"""

import pytest
from my_controller.controller import MyController

from benchmark.admission.conformance import Case, cases
from benchmark.control import plugins
from benchmark.scenario import catalogue
from benchmark.study.episode import Episode, run

REFERENCE = "my_controller.controller:MyController"


@pytest.mark.parametrize("case", cases(MyController), ids=str)
def test_it_keeps_to_the_contract(case: Case) -> None:
    case.verify()


def test_it_takes_its_options() -> None:
    assert plugins.find(f"{REFERENCE}?hold=15").options == {"hold": 15.0}


@pytest.mark.parametrize("name", ["smoke/crossing", "smoke/tee"])
def test_vehicles_arrive_and_do_not_collide(name: str) -> None:
    # Seeds 1 to 1000 are for evaluation: choose settings and test on others.
    record = run(Episode(catalogue.one(name), REFERENCE, rate=0.6, seed=1001))
    assert record.status == "ok", record.reason
    assert record.trips is not None
    assert record.trips.arrived > 0
    assert record.trips.collisions == 0
