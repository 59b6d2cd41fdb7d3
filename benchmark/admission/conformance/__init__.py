"""Does a controller keep to the contract? For its author, on the command line and in pytest.

On the command line it is ``rightofway check controller NAME``; in a plugin's own tests:

    import pytest
    from benchmark import conformance_cases

    @pytest.mark.parametrize("case", conformance_cases("my-controller"), ids=str)
    def test_keeps_to_the_contract(case):
        case.verify()

What is checked stands in ``checks.py``. Some of it happens in processes of their own, some in this
one: check code that you trust. The kit does not show that code which nobody trusts gets at nothing
but the contract; running it isolated enforces it.
"""

from benchmark.admission.conformance.cases import Case, check_controller, conformance_cases
from benchmark.admission.conformance.result import Result

__all__ = ["Case", "Result", "check_controller", "conformance_cases"]
