"""The life of an isolated controller's process, as its runner sees it."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from benchmark.control.guard import ControllerFailedError
from benchmark.control.isolation import channel
from benchmark.control.isolation.channel import Channel, MalformedError
from benchmark.plumbing.errors import ControllerError

KEPT = ("PATH", "LANG", "LC_ALL", "LC_CTYPE", "TZ", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH")
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
TORCH_CACHE = "TORCHINDUCTOR_CACHE_DIR"  # torch makes it when it loads anything
START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[2]); "
    "from benchmark.control.isolation.child import main; main()"
)
LAST_BREATH = 1.0  # s that a process may take to end after it has hung up

Reply = TypeVar("Reply", bound=channel.Message)


class Process:
    """A process that answers questions about a controller, with nothing of ours but one socket.

    Args:
        told: makes a fault's reason readable, as paths are other ones there.

    Raises:
        ControllerError: this system cannot isolate.
    """

    def __init__(self, told: Callable[[str], str] = str) -> None:
        self._told = told
        if os.name != "posix":
            raise ControllerError(
                "controllers are isolated on Linux and macOS only; "
                "run what you trust with --no-isolate"
            )
        self._folder = tempfile.TemporaryDirectory(
            prefix="rightofway-isolated-", ignore_cleanup_errors=True
        )
        home, temporary = (Path(self._folder.name, name) for name in ("home", "temporary"))
        home.mkdir()
        temporary.mkdir()
        ours, theirs = socket.socketpair()
        paths = [str(Path(path or ".").absolute()) for path in sys.path]
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603  (this Python, a list of arguments)
                [sys.executable, "-I", "-B", "-c", START, str(theirs.fileno()), json.dumps(paths)],
                env=_environment(home, temporary),
                cwd=home,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
            )
        self._channel = Channel(ours, channel.ANSWERS, channel.LARGEST)

    def ask(self, question: channel.Message, kind: type[Reply], doing: str, limit: float) -> Reply:
        """The answer to a question.

        Args:
            question: to be asked.
            kind: of answer that is expected.
            doing: what the controller does meanwhile, for messages.
            limit: of wall time [s].

        Raises:
            ControllerFailedError: there is no such answer.
        """
        deadline = clock.perf_counter() + limit
        try:
            self._channel.send(question, deadline)
            reply = self._channel.receive(deadline)
        except TimeoutError as error:
            reason = f"{doing}: no answer within {limit:.3g} s"
            raise ControllerFailedError(reason, "timed out") from error
        except MalformedError as error:
            raise ControllerFailedError(f"{doing}: malformed answer: {error}") from error
        except (EOFError, OSError) as error:
            reason = f"{doing}: the controller's process {self._end()}"
            raise ControllerFailedError(reason, "crashed") from error
        if isinstance(reply, channel.Fault):
            raise ControllerFailedError(self._told(reply.reason))
        if not isinstance(reply, kind):
            answer = f"got {type(reply).__name__}, expected {kind.__name__}"
            raise ControllerFailedError(f"{doing}: malformed answer: {answer}")
        return reply

    def _end(self) -> str:
        """How the process ended that hung up, in words."""
        try:
            code = self._process.wait(LAST_BREATH)
        except subprocess.TimeoutExpired:
            return "closed its connection"
        if code >= 0:
            return f"exited with code {code}"
        try:
            return f"was killed by {signal.Signals(-code).name}"
        except ValueError:
            return f"was killed by signal {-code}"

    def close(self) -> None:
        """End the process and all that it has started, and clear up."""
        self._channel.close()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._folder.cleanup()


def _environment(home: Path, temporary: Path) -> dict[str, str]:
    """What a controller needs of the environment, and no secrets."""
    kept = {name: os.environ[name] for name in KEPT if name in os.environ}
    folders = {"HOME": str(home), "TMPDIR": str(temporary), TORCH_CACHE: str(temporary)}
    return {**kept, **folders, **dict.fromkeys(ONE_THREAD, "1")}
