"""Does a controller keep to the contract? For its author, on the command line and in pytest.

On the command line it is ``rightofway check controller NAME``; in a plugin's own tests:

    import pytest
    from benchmark.conformance import cases

    @pytest.mark.parametrize("case", cases("my-controller"), ids=str)
    def test_keeps_to_the_contract(case):
        case.verify()

What is checked stands in ``benchmark.conformance.checks``. Some of it happens in processes of their
own, some in this one: check code that you trust. That code which nobody trusts gets at nothing but
the contract is not shown here; running it isolated enforces it.
"""

from benchmark.conformance.cases import Case, cases, check_controller
from benchmark.conformance.result import Result

__all__ = ["Case", "Result", "cases", "check_controller"]
