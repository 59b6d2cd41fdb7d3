"""Controllers that go wrong, for suites that must go on."""

from collections.abc import Iterator

import pytest
from plugins import install

from benchmark.control import plugins


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The hostile controllers are installed, here and in worker processes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(install(tmp_path_factory.mktemp("site") / "hostile"))
        plugins.discovered.cache_clear()
        yield
    plugins.discovered.cache_clear()
