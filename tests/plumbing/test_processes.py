"""Worker processes: they leave Ctrl-C to their parent, and end without a word."""

import signal
import subprocess
import sys

from factories.processes import PATIENCE

from benchmark.plumbing.processes import working

SCRIPT = """
import os, signal
from benchmark.plumbing.processes import pool

if __name__ == "__main__":
    heard = []
    signal.signal(signal.SIGINT, lambda *_: heard.append(1))
    with pool(2) as workers:
        for _ in range(20):  # most of them while the workers are only starting
            os.killpg(0, signal.SIGINT)
            workers.schedule(abs, args=(-1,)).add_done_callback(lambda one: print(one.result()))
    print(len(heard) > 0)
"""


def test_workers_do_not_hear_ctrl_c_even_while_they_start() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        capture_output=True,
        text=True,
        start_new_session=True,
        timeout=PATIENCE,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split() == ["1"] * 20 + ["True"]


def test_sigterm_ends_a_worker_without_python_even_as_it_ends_by_itself() -> None:
    with working(1) as workers:
        handler = workers.schedule(signal.getsignal, args=[signal.SIGTERM])
        assert handler.result(PATIENCE) is signal.SIG_DFL
