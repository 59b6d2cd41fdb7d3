"""Takes the README's pictures of the results site and a replay: `make screenshots`."""

import sys
from contextlib import ExitStack
from pathlib import Path

from browser import Visit, program
from playwright.sync_api import Page, sync_playwright

LARGEST = 300_000  # bytes of a picture
SHARPNESS = 1.25  # pixels of the picture per pixel of the page


def main(site: Path, target: Path) -> None:
    """Write a picture of the overview, of a scenario and of a replay."""
    found = program()
    if found is None:
        sys.exit(
            "no Chromium to take pictures with: `apt-get install chromium`, or name it in CHROMIUM"
        )
    with sync_playwright() as play, ExitStack() as contexts:
        visit = Visit(play.chromium.launch(executable_path=found), contexts)

        def opened(page: str, height: int, *, dark: bool) -> Page:
            size = {"width": 1200, "height": height}
            return visit(
                site / page, within=site, dark=dark, viewport=size, device_scale_factor=SHARPNESS
            )

        take(opened("index.html", 860, dark=False), target / "site-overview.png")
        scenario = opened("scenarios/colorado-springs-334.html", 1010, dark=True)
        scenario.wait_for_selector(".canvas svg")
        scenario.get_by_label("logarithmic").check()
        scenario.wait_for_timeout(300)  # until it is drawn again
        take(scenario, target / "site-scenario.png")
        replay = visit(
            f"{(site / 'replays' / '334.html').resolve().as_uri()}#t=650",
            viewport={"width": 1200, "height": 850},
            device_scale_factor=SHARPNESS,
        )
        replay.wait_for_timeout(500)  # until it is drawn
        take(replay, target / "replay.png")
    if visit.troubles:
        sys.exit("\n".join(visit.troubles))


def take(page: Page, target: Path) -> None:
    """Write a picture of what the window shows."""
    picture = page.screenshot(path=target)
    print(f"{target}: {len(picture) // 1000} kB")  # noqa: T201 - a command says what it did
    if len(picture) > LARGEST:
        sys.exit(f"{target}: larger than {LARGEST // 1000} kB; show less")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
