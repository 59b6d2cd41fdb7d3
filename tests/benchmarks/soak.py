"""A suite under random faults: its workers killed, crashed and frozen, the command killed.

``make soak`` runs a study undisturbed, then again under faults, started anew whenever it ended, and
compares: each record there, once, equal but for its wall time, and the same leaderboard.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil

COMMAND = Path(sys.executable).parent / "rightofway"
CONTROLLERS = ("traffic-light", "virtual-signal", "first-come", "time-windows", "wang-tuned")
STUDY = ("smoke/tee", "smoke/crossing", "smoke/asymmetric", "334", "--rate", "0.6")
STUDY += tuple(word for name in CONTROLLERS for word in ("--controller", name))
BOARDS = ("LEADERBOARD.md", "leaderboard.csv")
HANG = 20.0  # s until an episode counts as hanging; the slowest takes a quarter of that
FAULTS = {
    "worker killed": 8,
    "worker crashed": 4,
    "worker frozen": 1,
    "command killed": 3,
    "command interrupted": 1,
}  # with how often each is drawn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="twenty episodes each")
    parser.add_argument("--pause", type=float, default=1.0, help="mean time between faults [s]")
    parser.add_argument("--draw", type=int, default=1, help="seed of the faults")
    parser.add_argument("--cluster", action="store_true", help="on a Dask cluster of this machine")
    options = parser.parse_args()
    study = (*STUDY, "--seeds", str(options.seeds), "--time-limit", str(HANG))
    with tempfile.TemporaryDirectory(prefix="soak-") as folder:
        calm, stormy = Path(folder) / "calm", Path(folder) / "stormy"
        began = time.monotonic()
        with started(calm, study) as process:
            assert process.wait() == 0
        took = time.monotonic() - began
        where = ("--cluster", "local") if options.cluster else ()
        faults, starts = storm(stormy, (*study, *where), options.pause, options.draw)
        compare(calm, stormy)
        rough = time.monotonic() - began - took
    episodes = len(CONTROLLERS) * 4 * options.seeds
    say(f"{episodes} episodes: undisturbed {took:.0f} s, under faults {rough:.0f} s")
    say(f"{sum(faults.values())} faults, {starts} starts of the command")
    for name, count in faults.items():
        say(f"  {name}: {count}")
    say("every record is there once and equal, and the leaderboard is the same")


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")


def started(out: Path, study: tuple[str, ...]) -> "subprocess.Popen[bytes]":
    """The command under way, in a process group of its own."""
    return subprocess.Popen(
        [COMMAND, "run", *study, "--out", out],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def storm(out: Path, study: tuple[str, ...], pause: float, draw: int) -> tuple[Counter[str], int]:
    """Run a study to its end under faults; how often each happened, and how often it started."""
    chance = random.Random(draw)
    faults: Counter[str] = Counter()
    for starts in range(1, 1000):
        with started(out, study) as process:
            while process.poll() is None:
                time.sleep(chance.expovariate(1 / pause))
                (name,) = chance.choices(list(FAULTS), FAULTS.values())
                if befall(process.pid, name, chance):
                    faults[name] += 1
        if process.returncode == 0:
            return faults, starts
    raise AssertionError("never ended")


def befall(pid: int, name: str, chance: random.Random) -> bool:
    """Let a fault happen to the command or one of its workers, if there is one."""
    try:
        command = psutil.Process(pid)
        if name.startswith("command"):
            command.send_signal(signal.SIGKILL if name.endswith("killed") else signal.SIGINT)
            return True
        victims = [one for one in command.children(recursive=True) if "spawn_main" in cmdline(one)]
        if victims:
            how = {"killed": signal.SIGKILL, "crashed": signal.SIGSEGV, "frozen": signal.SIGSTOP}
            chance.choice(victims).send_signal(how[name.split()[1]])
        return bool(victims)
    except psutil.Error:  # it has just ended
        return False


def cmdline(process: psutil.Process) -> str:
    try:
        return " ".join(process.cmdline())
    except psutil.Error:
        return ""


def compare(calm: Path, stormy: Path) -> None:
    """Every record of the calm run is in the other once and equal; nothing else is there."""
    expected, found = list(records(calm)), list(records(stormy))
    broke = [one for one in found if one["status"] in ("crashed", "timed out")]
    whole = [one for one in found if one not in broke]
    assert sorted(map(figures, whole)) == sorted(map(figures, expected))
    for name in BOARDS:
        assert (stormy / name).read_bytes() == (calm / name).read_bytes(), name
    say(f"{len(broke)} episodes were struck twice, recorded so, and run again by the next start")


def records(out: Path) -> Iterator[dict[str, Any]]:
    for path in sorted((out / "records").glob("*.jsonl")):
        for line in path.read_text().splitlines():
            yield json.loads(line)


def figures(record: dict[str, Any]) -> str:
    return json.dumps(record | {"wall_time": 0})


if __name__ == "__main__":
    os.environ.setdefault("COLUMNS", "100")
    main()
