"""Shows a site on this machine only."""

import errno
from functools import partial
from http import HTTPStatus
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from benchmark.plumbing.errors import UsageError

HOST = "127.0.0.1"
NAMES = (HOST, "localhost")  # that a request may be meant for
POLICY = "; ".join(
    (
        *("default-src 'none'", "script-src 'self'", "style-src 'self' 'unsafe-inline'"),
        *("img-src 'self' data: blob:", "base-uri 'none'", "form-action 'none'"),
        "frame-ancestors 'none'",
    )
)  # what pages may load; charts and their tooltips set styles
REPLAY_POLICY = POLICY.replace("script-src 'self'", "script-src 'unsafe-inline'")


def site_server(folder: Path, port: int) -> ThreadingHTTPServer:
    """A server that is ready to run, bound to 127.0.0.1 alone.

    Args:
        folder: a site.
        port: to listen on; 0 takes any that is free.

    Raises:
        UsageError: the folder holds no site, or the port cannot be had.
    """
    if not (folder / "index.html").is_file():
        raise UsageError(f"{folder}: no site here; make one with `rightofway site -o {folder}`")
    try:
        return _Server((HOST, port), partial(_Handler, directory=str(folder)))
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            reason = "is taken by another program"
        elif error.errno == errno.EACCES:
            reason = "needs rights that this user lacks"
        else:
            reason = f"cannot be had: {error.strerror}"
        raise UsageError(f"port {port} {reason}; choose another with --port") from error


class _Server(ThreadingHTTPServer):
    request_queue_size = 128  # a browser opens more at once than the five that may wait by default


class _Handler(SimpleHTTPRequestHandler):
    """Files of the folder, and nothing else."""

    def send_head(self) -> Any:
        """Refuse what is meant for another name: a page elsewhere may point its name here."""
        host = self.headers.get("Host", "").rpartition(":")[0] or self.headers.get("Host", "")
        if host not in NAMES:
            self.send_error(HTTPStatus.FORBIDDEN, "only for this machine")
            return None
        return super().send_head()

    def list_directory(self, path: Any) -> Any:
        """No listing of folders."""
        self.send_error(HTTPStatus.NOT_FOUND, "no such page")

    def end_headers(self) -> None:
        """What a page may do, and that a site made anew is to be seen at once."""
        replay = self.path.startswith("/replays/")
        self.send_header("Content-Security-Policy", REPLAY_POLICY if replay else POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Cache-Control", "no-cache")
        super().end_headers()

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the base class names it
        """Say nothing: the terminal is for the user."""
