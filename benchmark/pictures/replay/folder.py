"""Replays beside records: a page for each episode that a study runs into a folder."""

from contextlib import suppress
from pathlib import Path

from benchmark.pictures.replay.page import page
from benchmark.pictures.replay.recorder import Recorder
from benchmark.plumbing.errors import StoreError
from benchmark.records.record import Record
from benchmark.reports.site.replays import FOLDER
from benchmark.study import action_log
from benchmark.study.action_log import Key
from benchmark.study.episode import Audience, Episode, run_episode
from benchmark.study.rescoring import run_logged


def folder_in(results: Path) -> Path:
    """Where a results folder keeps its replays; the results site links them from there."""
    return results / FOLDER


def run_recorded(episode: Episode, pages: Path, actions: Path | None = None) -> Record:
    """Run an episode and write the page that plays it; one that does not end well leaves none.

    Args:
        episode: what to run.
        pages: the folder for the page.
        actions: that for its action log, if one is wanted.

    Raises:
        RightOfWayError: the scenario cannot be run.
        StoreError: the disk refuses; nothing about the episode is wrong, but the study has to stop.
    """
    recorder = Recorder()
    if actions is None:
        record = run_episode(episode, Audience(onlooker=recorder))
    else:
        record = run_logged(episode, actions, recorder)
    if record.status == "ok":
        kept = recorder.trajectories(record)
        page.write([kept], pages / name_of(record.episode), StoreError)
    return record


def name_of(episode: Key) -> str:
    """The file's name, as that of its action log."""
    return Path(action_log.log_name(episode)).with_suffix(".html").name


def is_kept(pages: Path, episode: Key, identity: str) -> bool:
    """Whether a folder has the replay of just this episode."""
    with suppress(OSError), (pages / name_of(episode)).open(encoding="utf-8") as file:
        return page.shows(file.read(page.HEAD)) == [identity]
    return False
