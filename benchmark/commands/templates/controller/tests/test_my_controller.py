"""Does it keep to the contract, and does it do what it is for?"""

import pytest
from my_controller.controller import MyController

from benchmark import conformance_cases, run

REFERENCE = "my_controller.controller:MyController"


@pytest.mark.parametrize("case", conformance_cases(MyController), ids=str)
def test_it_keeps_to_the_contract(case):
    case.verify()


def test_it_takes_its_options():
    record = run("smoke/tee", f"{REFERENCE}?hold=15", rate=0.6, seed=1001)
    assert record.status == "ok", record.reason
    assert record.controller == f"{REFERENCE}?hold=15"


@pytest.mark.parametrize("name", ["smoke/crossing", "smoke/tee"])
def test_vehicles_arrive_and_do_not_collide(name):
    # Seeds 1 to 1000 are for evaluation: choose settings and test on others.
    record = run(name, REFERENCE, rate=0.6, seed=1001)
    assert record.status == "ok", record.reason
    assert record.trips is not None
    assert record.trips.arrived > 0
    assert record.trips.collisions == 0
