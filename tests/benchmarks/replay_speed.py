"""What replays cost: ``make replay-speed``; docs/replay.md keeps what it said.

Records an episode of each of the paper's intersections and plays it in headless Chromium from where
most vehicles are on the road, eight times as fast as it was, which is the hardest for the page.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import program

from benchmark.pictures.replay.page import page
from benchmark.pictures.replay.replay import Replay, recorded
from benchmark.pictures.replay.trajectories import Trajectories
from benchmark.scenario import catalogue
from benchmark.study.episode import Episode, run_episode
from benchmark.study.episodes import build_ahead

SECONDS = 5
COUNT = """() => new Promise((done) => {
  const gaps = []; let last = performance.now(); const end = last + SECONDS * 1000;
  const next = (now) => {
    gaps.push(now - last); last = now;
    if (now < end) requestAnimationFrame(next); else done(gaps.slice(1));
  };
  requestAnimationFrame(next);
})""".replace("SECONDS", str(SECONDS))


def main() -> None:
    say("| | page | recording | vehicles | frames a second | frames later than 25 ms |")
    say("|---|---|---|---|---|---|")
    with sync_playwright() as play, tempfile.TemporaryDirectory() as folder:
        browser = play.chromium.launch(executable_path=program())
        for name in ("229", "332", "334", "449"):
            episode = Episode(catalogue.find_scenario(name), "time-windows", 0.6, 1)
            build_ahead([episode])
            plain, watched, kept = costs(episode)
            path = Replay([kept]).write(Path(folder) / f"{name}.html")
            most, moment = busiest(kept)
            opened = browser.new_page(viewport={"width": 1280, "height": 800}, bypass_csp=True)
            opened.goto(f"{path.as_uri()}#t={moment}")
            opened.wait_for_timeout(1000)
            opened.select_option("#speed", "8")
            opened.get_by_role("button", name="Play").click()
            gaps = np.array(opened.evaluate(COUNT))
            late = 100 * np.mean(gaps > 25)
            say(
                f"| {name} | {len(page.page([kept])) / 1e6:.2f} MB "
                f"| {100 * (watched / plain - 1):+.0f} % | {most} "
                f"| {1000 / gaps.mean():.0f} | {late:.0f} % |"
            )
            opened.close()


def costs(episode: Episode) -> tuple[float, float, Trajectories]:
    """Wall time without and with a recorder [s], the best of three, and what it kept."""
    plain, watched = [], []
    for _ in range(3):
        began = time.monotonic()
        run_episode(episode)
        between = time.monotonic()
        kept = recorded(episode)
        plain.append(between - began)
        watched.append(time.monotonic() - between)
    return min(plain), min(watched), kept


def busiest(kept: Trajectories) -> tuple[int, float]:
    """The most vehicles that are on the road at once, and a time just before that [s]."""
    counts = np.zeros(kept.steps, dtype=int)
    for first, steps in zip(kept.vehicles.first, kept.vehicles.steps, strict=True):
        counts[first : first + steps] += 1
    most = int(counts.argmax())
    return int(counts.max()), max(0.0, kept.start + kept.step * (most - 20))


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
