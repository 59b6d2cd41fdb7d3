"""Runs the SUMO programs that come with the ``eclipse-sumo`` wheel, and caches what they make."""

import hashlib
import os
import subprocess
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from pathlib import Path

from benchmark.plumbing import files
from benchmark.plumbing.errors import NetworkError, StoreError

SEEDS = 2**31  # that SUMO's programs take


def sumo_version() -> str:
    """The version of SUMO; part of the identity of every result."""
    return version("eclipse-sumo")


def program_path(name: str) -> Path:
    """The path of a SUMO program, as in ``program("netconvert")``."""
    import sumo

    return Path(sumo.SUMO_HOME) / "bin" / name


@cache
def sumo_environment() -> dict[str, str]:
    """The environment for SUMO programs: this package's SUMO, whatever else is installed."""
    import sumo

    return {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}


def run_program(name: str, *options: str) -> str:
    """Run a SUMO program to its end.

    Returns:
        Its warnings, one per line; empty where it had none.

    Raises:
        NetworkError: it failed; the message holds its last words.
    """
    done = subprocess.run(  # noqa: S603  (our own program, a list of arguments, no shell)
        [str(program_path(name)), *options], capture_output=True, text=True, env=sumo_environment()
    )
    if done.returncode != 0:
        words = (done.stderr.strip() or done.stdout.strip()).splitlines()[-6:]
        raise NetworkError(f"{name} failed: " + " / ".join(words))
    return "\n".join(line for line in done.stderr.splitlines() if line.startswith("Warning"))


def sumo_seed(seed: int) -> int:
    """The seed that SUMO's programs get: of 31 bits as it is, else a hash of it."""
    if seed < SEEDS:
        return seed
    data = hashlib.blake2b(f"sumo/{seed}".encode(), digest_size=8).digest()
    return int.from_bytes(data) % SEEDS


def digest(*parts: str | bytes) -> str:
    """SHA-256 over parts, none of which can run into the next."""
    total = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        total.update(len(data).to_bytes(8, "big") + data)
    return total.hexdigest()


def cached(kind: str, key: str, build: Callable[[Path], None]) -> Path:
    """A folder that ``build`` fills once per key, safe against other processes doing the same.

    Raises:
        StoreError: the cache folder cannot be written.
    """
    place = files.cache_folder() / kind / key
    remedy = "set RIGHTOFWAY_CACHE to a folder you can write"
    with files.writing(place.parent, "the cache", StoreError, remedy):
        return files.made_once(place, build)
