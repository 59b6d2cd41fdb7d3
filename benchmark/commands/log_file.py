"""Lines of JSON about a running suite, for machines to follow.

Standard logging, as other libraries log with it too: their warnings land in the same file.
"""

import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from benchmark.commands import console
from benchmark.plumbing.files import writing


@contextmanager
def following(path: Path | None) -> Iterator[None]:
    """Append what is logged meanwhile to a file; None: to none.

    Raises:
        UsageError: the file cannot be written.
    """
    if path is None:
        yield
        return
    with writing(path, remedy="choose another file with --log-file"):
        path.parent.mkdir(parents=True, exist_ok=True)
        handler = _Handler(path, encoding="utf-8")
    handler.setFormatter(_Lines())
    root, own = logging.getLogger(), logging.getLogger("rightofway")
    root.addHandler(handler)
    own.setLevel(logging.INFO)
    try:
        yield
    finally:
        root.removeHandler(handler)
        own.setLevel(logging.NOTSET)
        handler.close()


class _Handler(logging.FileHandler):
    """A log that cannot be written any more is no reason to stop a suite."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - logging's name
        console.notice(f"{self.baseFilename}: cannot be written any more")
        logging.getLogger().removeHandler(self)


class _Lines(logging.Formatter):
    """A line of JSON: time, level, where it is from, what happened, and its facts."""

    def format(self, record: logging.LogRecord) -> str:
        line = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "event": record.getMessage(),
            **getattr(record, "facts", {}),
        }
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, default=str)
