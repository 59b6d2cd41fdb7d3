"""Pages in a real Chromium: fixtures that note errors and any request that leaves the page.

``visit(path)`` opens a page and holds it to three promises until the test is over: nothing is
written to the console as an error, no script fails, and nothing is requested but the page itself
(or, with ``within``, files of that folder).
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import (
    Browser,
    BrowserContext,
    Page,
    Request,
    Route,
    expect,
    sync_playwright,
)

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
PHONE = {"width": 360, "height": 740}
DESK = {"width": 1280, "height": 800}
PATIENCE = 300_000  # ms that a test waits for what is to appear
SERIOUS = ("serious", "critical")  # impacts, in axe's words


def program() -> str | None:
    """The Chromium to use: the one CHROMIUM names, or the first on the path."""
    named = os.environ.get("CHROMIUM")
    return next(filter(None, map(shutil.which, [named] if named else NAMES)), None)


def required_program() -> str:
    """The Chromium, without which a test is skipped, or fails under `make test`."""
    if found := program():
        return found
    text = (
        "no Chromium on this machine, so the pages are not tested; install it, as in "
        "`apt-get install chromium`, or name its program in the variable CHROMIUM"
    )
    if os.environ.get("RIGHTOFWAY_TESTS_NEED_CHROMIUM"):
        pytest.fail(text)
    pytest.skip(text)


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    """A headless Chromium; per module, as playwright holds asyncio's loop while it runs."""
    found = required_program()
    with sync_playwright() as play:
        browser = play.chromium.launch(
            executable_path=found,
            args=["--disable-dev-shm-usage", "--hide-scrollbars"],
            timeout=PATIENCE,
        )
        expect.set_options(timeout=PATIENCE)
        yield browser
        browser.close()


class Visit:
    """Opens pages and collects their troubles: console errors, failures, requests to elsewhere."""

    def __init__(self, browser: Browser, contexts: ExitStack) -> None:
        self.troubles: list[str] = []
        self.requests: list[str] = []
        self._browser = browser
        self._contexts = contexts

    def __call__(
        self,
        place: Path | str,
        *,
        within: Path | None = None,
        phone: bool = False,
        dark: bool = False,
        **settings: Any,
    ) -> Page:
        """Open a file, or an address of this machine, in a window of its own.

        ``place`` may carry a fragment when it is an address. ``within`` is the folder whose files
        may be requested too; ``settings`` are those of playwright's ``new_context``.
        """
        address = place.resolve().as_uri() if isinstance(place, Path) else place
        allowed = _allowed(address, within)
        context = self._browser.new_context(
            **{
                "viewport": PHONE if phone else DESK,
                "color_scheme": "dark" if dark else "light",
                "has_touch": phone,
                **settings,
            }
        )
        context.set_default_timeout(PATIENCE)
        self._contexts.callback(context.close)
        page = context.new_page()
        self._watch(context, page, allowed)
        page.goto(address)
        return page

    def _watch(self, context: BrowserContext, page: Page, allowed: tuple[str, ...]) -> None:
        def asked(route: Route, request: Request) -> None:
            self.requests.append(request.url)
            if request.url.startswith((*allowed, "data:", "blob:")):
                route.continue_()
            else:
                self.troubles.append(f"requested {request.url}")
                route.abort()

        context.route("**/*", asked)
        page.on("websocket", lambda socket: self.troubles.append(f"opened {socket.url}"))
        page.on("pageerror", lambda error: self.troubles.append(f"failed: {error}"))
        page.on("console", self._said)

    def _said(self, message: Any) -> None:
        if message.type in ("error", "warning"):
            self.troubles.append(f"console {message.type}: {message.text}")


def _allowed(address: str, within: Path | None) -> tuple[str, ...]:
    if within is not None:
        return (f"{within.resolve().as_uri()}/",)
    parts = urlsplit(address)
    if parts.scheme == "file":
        return (address.split("#")[0].split("?")[0],)
    return (f"{parts.scheme}://{parts.netloc}/",)


@pytest.fixture
def visit(chromium: Browser) -> Iterator[Visit]:
    """Opens pages; the test fails at its end if one of them broke a promise."""
    with ExitStack() as contexts:
        visiting = Visit(chromium, contexts)
        yield visiting
    assert not visiting.troubles


def accessibility_violations(page: Page) -> list[str]:
    """What axe-core finds serious or critical on the page as it is now, a line each."""
    # axe would fetch style sheets, which a browser refuses for files; what it sees suffices
    found = Axe().run(page, options={"preload": False}).response["violations"]
    return [
        f"{one['id']} ({one['impact']}): {one['help']}: "
        + "; ".join(" ".join(map(str, node["target"])) for node in one["nodes"][:5])
        for one in found
        if one["impact"] in SERIOUS
    ]


def wider_than_its_window(page: Page) -> bool:
    """Whether the page as a whole scrolls sideways, which it must not on a phone."""
    return bool(
        page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth")
    )
