"""The command ``rightofway``, run in this process."""

import io
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from benchmark.commands.app import main


def rightofway(
    folder: Path, *words: str | Path, **variables: str | Path
) -> subprocess.CompletedProcess[str]:
    """Run the command in a folder, without the cost of a process.

    Args:
        folder: the current one meanwhile.
        words: of the command.
        variables: of the environment.
    """
    arguments = [*map(str, words)]
    out, err = io.StringIO(), io.StringIO()
    with (
        pytest.MonkeyPatch.context() as patch,
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        patch.chdir(folder)
        for name, value in {"COLUMNS": "250", **variables}.items():
            patch.setenv(name, str(value))
        patch.setattr(sys, "argv", ["rightofway", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
    assert isinstance(end.value.code, int)
    return subprocess.CompletedProcess(arguments, end.value.code, out.getvalue(), err.getvalue())
