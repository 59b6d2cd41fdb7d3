"""The command as users meet it: what it prints, writes and refuses."""

import csv
import io
import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import tomli_w
from factories.command_line import rightofway
from factories.processes import PATIENCE, without_sumo
from factories.scenarios import ROOT, SCENARIOS, SHIPPED, SMOKE, edited
from factories.workers import without_workers
from plugins import install

from benchmark import __version__
from benchmark.control import plugins

COMMAND = Path(sys.executable).parent / "rightofway"
SLOW = {"libsumo", "matplotlib", "scipy", "polars", "torch", "altair", "PIL", "distributed"}

Command = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Runs the command in the test's folder, without a screen."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)

    def run(*words: str | Path, **variables: str | Path) -> subprocess.CompletedProcess[str]:
        return rightofway(tmp_path, *words, **variables)

    return run


def study(*more: str) -> tuple[str, ...]:
    """Arguments of a small study: three episodes."""
    names = ("--controller", "traffic-light", "--controller", "virtual-signal")
    return "run", "smoke/crossing", *names, "--rate", "0.4", "--rate", "0.6", "--seed", "7", *more


def records(folder: Path) -> list[dict[str, object]]:
    return [
        json.loads(line)
        for file in sorted((folder / "records").glob("*.jsonl"))
        for line in file.read_text().splitlines()
    ]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results folder of the small study."""
    folder = tmp_path_factory.mktemp("results")
    with without_workers():
        done = rightofway(folder, *study("--out", str(folder)))
    assert done.returncode == 0, done.stderr
    return folder


def test_the_installed_command_says_what_the_one_in_this_process_says(command: Command) -> None:
    for words in (["--version"], ["run", "smoke/crosing"]):
        installed = subprocess.run(
            [COMMAND, *words], capture_output=True, text=True, timeout=PATIENCE
        )
        here = command(*words)
        assert (installed.returncode, installed.stdout) == (here.returncode, here.stdout)
        assert installed.stderr.split() == here.stderr.split()


def test_version_names_the_benchmark_and_sumo(command: Command) -> None:
    assert command("--version").stdout == f"rightofway {__version__}, SUMO 1.28.0\n"


def test_list_shows_every_scenario_and_controller(command: Command) -> None:
    done = command("list")
    assert done.returncode == 0
    words = [line.split()[0] for line in done.stdout.splitlines()]
    assert {*SHIPPED, *plugins.discovered()} <= set(words)


def test_check_finds_nothing_wrong_with_good_scenarios(command: Command) -> None:
    done = command("check", "crossing", SCENARIOS / "smoke" / "tee.toml")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("all well") == 2


def test_check_finds_nothing_wrong_with_a_good_controller(command: Command) -> None:
    chosen = ("first-come", "traffic-light", "--scenario", "tee")
    done = command("check", "controller", *chosen)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("10 passed\n") == 2
    (line,) = (one for one in done.stdout.splitlines() if "lights on; commands no vehicle" in one)
    assert "declares" in line


def test_check_shows_a_broken_promise_with_what_to_do_and_ends_in_exit_code_1(
    command: Command,
) -> None:
    unruly = ROOT / "tests" / "plugins" / "unruly.py"
    done = command("check", "controller", f"{unruly}:FourOnly")
    assert (done.returncode, done.stderr) == (0, "")
    assert "18 passed, 8 skipped\n" in done.stdout
    assert "skipped │ it needs 4 approaches, and the scenario has 3" in done.stdout
    chosen = (f"{unruly}:Remembers", f"{unruly}:Tame")
    done = command("check", "controller", *chosen, "--scenario", "tee")
    assert (done.returncode, done.stderr) == (1, "")
    assert "9 passed, 1 failed\n" in done.stdout
    assert "10 passed\n" in done.stdout
    assert "reset must set anew whatever act changes" in done.stdout


def test_a_file_of_the_name_controller_is_a_scenario_where_nothing_follows(
    command: Command, tmp_path: Path
) -> None:
    (tmp_path / "controller").write_bytes((SCENARIOS / "smoke" / "tee.toml").read_bytes())
    assert "all well" in command("check", "controller").stdout
    assert "all well" in command("check", "./controller").stdout
    assert command("check", "controller", "frst-come").returncode == 2


def test_check_reports_what_is_doubtful_and_still_succeeds(command: Command) -> None:
    done = command("check", "asymmetric")
    assert (done.returncode, done.stderr) == (0, "")
    assert "a car needs 43 m to stop from 15.65 m/s but decides only 30 m" in done.stdout
    assert "120 s are too short to show what comes of doing nothing" in done.stdout
    assert "5 findings" in done.stdout


@pytest.mark.parametrize(
    ("options", "file", "start"),
    [
        ((), "smoke-tee.png", b"\x89PNG"),
        (("-o", "new/drawing.svg"), "new/drawing.svg", b"<?xml"),
    ],
)
def test_show_writes_a_drawing(
    command: Command, tmp_path: Path, options: tuple[str, ...], file: str, start: bytes
) -> None:
    done = command("show", "smoke/tee", *options)
    assert (done.returncode, done.stdout) == (0, f"{file}\n")
    drawing = (tmp_path / file).read_bytes()
    assert drawing.startswith(start)
    assert len(drawing) > 10_000


def test_show_draws_the_program_that_a_controller_runs(command: Command, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(tomli_w.dumps(edited({"signal.phases.1.minimum_green": 17})))
    command("show", "a.toml", "--controller", "traffic-light-webster", "-o", "a.svg")
    assert ">17 s<" in (tmp_path / "a.svg").read_text()
    refused = command("show", "a.toml", "--controller", "first-come")
    assert refused.returncode == 2
    assert "first-come: shows no signal program; expected one that does" in refused.stderr


@pytest.mark.parametrize("name", SMOKE)
def test_the_proposed_signal_passes_check_in_place_of_the_deployed_one(
    command: Command, tmp_path: Path, name: str
) -> None:
    done = command("signal", name)
    document = tomllib.loads((SCENARIOS / f"{name}.toml").read_text())
    proposed = tomllib.loads(done.stdout)
    assert proposed["signal"] != document["signal"]
    (tmp_path / "retimed.toml").write_text(tomli_w.dumps(document | proposed))
    checked = command("check", "retimed.toml")
    assert (done.returncode, checked.returncode, checked.stderr) == (0, 0, "")
    assert "degree of saturation" not in checked.stdout


def test_schema_is_the_one_in_the_repository(command: Command) -> None:
    done = command("schema")
    assert (done.returncode, done.stdout) == (0, (SCENARIOS / "schema.json").read_text())


def test_run_writes_one_record_per_episode_and_the_leaderboard(results: Path) -> None:
    found = sorted(str((one["controller"], one["rate"], one["seed"])) for one in records(results))
    assert found == [
        "('traffic-light', None, 7)",
        "('virtual-signal', 0.4, 7)",
        "('virtual-signal', 0.6, 7)",
    ]
    assert {one["status"] for one in records(results)} == {"ok"}
    assert "virtual-signal" in (results / "LEADERBOARD.md").read_text()
    assert "virtual-signal" in (results / "leaderboard.csv").read_text()


@pytest.mark.usefixtures("without_workers")
def test_seeds_counts_from_one_and_every_controller_runs_by_default(
    command: Command, tmp_path: Path
) -> None:
    done = command("run", "smoke/tee", "--seeds", "2")
    assert done.returncode == 0, done.stderr
    found = {(one["controller"], one["seed"]) for one in records(tmp_path / "out")}
    assert found == {(name, seed) for name in plugins.discovered() for seed in (1, 2)}


def test_running_again_appends_and_leaves_the_leaderboard_as_it_is(
    command: Command, tmp_path: Path
) -> None:
    boards = []
    for times in (1, 2):
        done = command(*study("--out", "here", "--workers", str(times), "--force"))
        assert done.returncode == 0, done.stderr
        assert len(records(tmp_path / "here")) == 3 * times
        boards.append([(tmp_path / "here" / n).read_bytes() for n in BOARDS])
    assert boards[0] == boards[1]


BOARDS = ("LEADERBOARD.md", "leaderboard.csv")


LINES = """
import sys
from benchmark.commands.app import main
for line in sys.argv[1:]:
    sys.argv = ["rightofway", *line.split()]
    try:
        main()
    except SystemExit as end:
        print(f"<{end.code}>", end="", flush=True)
"""
"""A script that runs one command for each of its arguments."""


def test_the_leaderboard_comes_in_every_format_without_sumo(results: Path, tmp_path: Path) -> None:
    path = os.pathsep.join([str(without_sumo(tmp_path / "no-sumo")), *sys.path])
    board = f"leaderboard --records {results}"
    formats = [f"{board} --format {form}" for form in ("md", "csv", "json", "latex")]
    done = subprocess.run(
        [sys.executable, "-c", LINES, board, *formats, "check crossing"],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert " is not here" in done.stderr  # the shim works: the last command needs SUMO
    shown, md, table, rows, latex, last = done.stdout.split("<0>")
    assert last == ""
    assert "traffic-light" in shown
    assert md == (results / "LEADERBOARD.md").read_text()
    names = [row["controller"] for row in csv.DictReader(io.StringIO(table))]
    assert names == [row["controller"] for row in json.loads(rows)]
    assert len(names) == 4  # the signal stands at both rates
    assert r"\begin{tabular}" in latex
    assert r"\end{tabular}" in latex


def test_the_leaderboard_leaves_variants_out_on_request(
    command: Command, results: Path, tmp_path: Path
) -> None:
    (source,) = (results / "records").glob("*.jsonl")
    target = tmp_path / "records" / source.name
    target.parent.mkdir()
    name, variant = '"virtual-signal"', '"virtual-signal?green=15"'
    target.write_text(source.read_text() + source.read_text().replace(name, variant))

    def controllers(option: str) -> set[str]:
        shown = command("leaderboard", "--records", tmp_path, "--format", "csv", option).stdout
        return {one["controller"] for one in csv.DictReader(io.StringIO(shown))}

    assert controllers("--no-variants") == {"traffic-light", "virtual-signal"}
    assert controllers("--variants") == {*controllers("--no-variants"), "virtual-signal?green=15"}


def test_the_leaderboard_takes_the_records_folder_too(command: Command, results: Path) -> None:
    both = [command("leaderboard", "--records", one) for one in (results, results / "records")]
    assert both[0].stdout == both[1].stdout != ""


@pytest.mark.parametrize("argument", ["--help", "list"])
def test_the_command_answers_at_once(argument: str) -> None:
    """What takes long to load is loaded by those commands alone that need it."""
    code = (
        "import sys; from benchmark.commands.app import main\n"
        f"sys.argv = ['rightofway', '{argument}']\n"
        "try: main()\n"
        f"finally: print(*sorted({SLOW} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE
    )
    assert (done.returncode, done.stderr) == (0, "\n")


def test_without_arguments_it_says_what_it_can_do(command: Command) -> None:
    done = command()
    assert "rightofway [OPTIONS] COMMAND" in done.stdout + done.stderr
    assert "leaderboard" in done.stdout + done.stderr


GREENS = {"signal.phases.1.movements": ["N-C", "S-C", "W-L"]}
TWO_FAULTS = {"evaluation.duraton": 60, "intersection.speed_cap": -1}


@pytest.fixture
def bad_files(tmp_path: Path) -> None:
    """Files that the table below names."""
    (tmp_path / "file").touch()
    (tmp_path / "empty").mkdir()
    (tmp_path / "syntax.toml").write_text("schema = = 1")
    (tmp_path / "greens.toml").write_text(tomli_w.dumps(edited(GREENS)))
    (tmp_path / "faults.toml").write_text(tomli_w.dumps(edited(TWO_FAULTS)))
    (tmp_path / "garbled" / "records").mkdir(parents=True)
    (tmp_path / "garbled" / "records" / "a.jsonl").write_text("{}\nnonsense\n")


NO_SCREEN = "watch smoke/tee --controller virtual-signal"
GREEN_WORDS = ("greens", "phases[1]", "N-C and W-L conflict", "split the phase")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("lst", ("\"lst\"|'lst'", "list")),
        ("check missing.toml", ("missing.toml", "cannot read the file: No such file")),
        ("check syntax.toml", ("syntax.toml", "not valid TOML", "line 1, column 10")),
        ("check greens.toml", GREEN_WORDS),
        (
            "check faults.toml",
            (
                'faults.toml: evaluation.duraton: unknown key "duraton"; did you mean "duration"',
                "faults.toml: intersection.speed_cap: should be greater than 0; got -1",
            ),
        ),
        ("check empty", ("empty", "no scenario files")),
        ("check controller", ("which controller?", "check controller NAME")),
        ("check controller frst-come", ('"frst-come"', 'did you mean "first-come"')),
        ("check controller first-come frst-come", ('"frst-come"', 'did you mean "first-come"')),
        ("check controller first-come --scenario smoke/te", ('"smoke/te"', '"smoke/tee"')),
        ("check smoke/tee --scenario smoke/tee", ("--scenario goes with `check controller`",)),
        ("check controller gone.py:Mine", ("gone.py: cannot read the controller: No such file",)),
        ("check controller syntax.toml", ('unknown controller "syntax.toml"',)),
        ("new controller First_Come", ('"First_Come"', 'did you mean "first-come"')),
        ("new controller empty", ("empty is there already",)),
        ("new scenario syntax", ("syntax.toml is there already",)),
        ("new sceanrio mine", ("sceanrio", "scenario")),
        ("check smoke/crosing", ('"smoke/crosing"', 'did you mean "smoke/crossing"')),
        ("show smoke", ('"smoke"', "smoke/asymmetric, smoke/crossing, smoke/tee", "choose one")),
        ("show nowhere", ('"nowhere"', "colorado-springs/229")),
        ("show smoke/tee -o drawing.gif", ("drawing.gif", ".png or .svg")),
        ("show smoke/tee -o file/drawing.png", ("file/drawing.png", "--output")),
        ("signal smoke/te", ('"smoke/te"', 'did you mean "smoke/tee"')),
        ("run smoke/crosing", ('"smoke/crosing"', 'did you mean "smoke/crossing"')),
        ("run syntax.toml", ("syntax.toml", "not valid TOML")),
        ("run greens.toml --controller traffic-light --seeds 1", GREEN_WORDS),
        ("run smoke --controller frst-come", ('"frst-come"', 'did you mean "first-come"')),
        ("run smoke/tee first-come", ("a controller, not a scenario",)),
        ("run smoke/tee --rate 0.4 0.6", ("a rate, not a scenario", "--rate 0.6")),
        ("run smoke/tee@99999", ("smoke/tee@99999", "10000 veh/h", "ask for fewer")),
        ("check smoke/tee@99999", ("smoke/tee@99999", "10000 veh/h", "ask for fewer")),
        (
            "run smoke/tee --controller virtual-signal?green=-3",
            ("green", "should be greater than 0; got"),
        ),
        (
            "run smoke/tee --controller max-pressure?interval=0",
            ("interval", "should be greater than 0; got"),
        ),
        ("replay smoke/tee", ("smoke/tee: a scenario", "--controller")),
        ("replay tee", ("tee: a scenario", "--controller")),
        ("run smoke --rate 1.5", ("--rate", "1.5: expected a share from 0 to 1")),
        ("run smoke --rate nan", ("--rate", "nan: expected a share from 0 to 1")),
        ("run smoke --seed -1", ("--seed", "expected at least 0")),
        ("run smoke --seeds 0", ("--seeds", "expected at least 1")),
        ("run smoke --workers 0", ("--workers", "expected at least 1")),
        ("run smoke --seed 9300000000000000000", ("--seed", "expected at most")),
        ("run smoke --seeds 2 --seed 1", ("--seeds and --seed", "give one of them")),
        ("run smoke --sed 1", ("--sed", "--seed, --seeds|--seed")),
        ("run smoke/tee --out file/below", ("file/below", "choose another folder")),
        ("leaderboard", ("out/records", "no records here", "rightofway run --out out")),
        ("leaderboard --records garbled", ("a.jsonl:1", "required")),
        ("leaderboard --records RESULTS --format html", ('"html"', "md, csv, json, latex")),
        ("leaderboard --records RESULTS --rate 0.9", ("--rate 0.9", "expected one of 0.4, 0.6")),
        ("leaderboard --records RESULTS --rate 0.4 --format csv", ("--rate", "leave out --format")),
        ("schema more", ("more", "schema --help")),
        (NO_SCREEN, ("watch needs a screen", "DISPLAY")),
        ("watch smoke/tee", ("--controller", "watch --help")),
        ("watch smoke/te --controller first-come", ('"smoke/te"', 'did you mean "smoke/tee"')),
    ],
)
@pytest.mark.usefixtures("bad_files")
def test_bad_input_ends_in_exit_code_2_and_one_message_with_the_remedy(
    command: Command, tmp_path: Path, request: pytest.FixtureRequest, line: str, words: list[str]
) -> None:
    if "RESULTS" in line:
        line = line.replace("RESULTS", str(request.getfixturevalue("results")))
    done = command(*line.split())
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.lower().count("error:") == 1
    assert "Traceback" not in done.stderr
    for word in words:
        assert any(choice in done.stderr for choice in word.split("|"))
    assert not records(tmp_path / "out")


def test_what_the_system_refuses_is_one_message(command: Command, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "records").symlink_to("records")  # a loop, which root cannot read either
    done = command("leaderboard")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: out/records: ")
    assert "Traceback" not in done.stderr
    with Path("/dev/full").open("w") as full:  # a disk without room behind >
        line = [COMMAND, "schema"]
        done = subprocess.run(
            line, stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENCE
        )
    assert (done.returncode, done.stderr) == (2, "error: No space left on device\n")


def test_a_signal_beside_one_that_is_there_is_warned_of(command: Command) -> None:
    done = command("signal", "smoke/tee")
    assert done.returncode == 0
    assert "[signal]" in done.stdout
    assert "has a signal program; take it out" in done.stderr


def test_a_cache_that_cannot_be_written_is_named_with_the_variable(
    command: Command, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    done = command("check", "smoke/tee", RIGHTOFWAY_CACHE=tmp_path / "file" / "cache")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("error:") == 1
    assert "file/cache" in done.stderr
    assert "set RIGHTOFWAY_CACHE to a folder you can write" in done.stderr


@pytest.fixture
def hostile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The hostile controllers are installed, here and in worker processes."""
    monkeypatch.syspath_prepend(install(tmp_path / "site"))
    plugins.discovered.cache_clear()
    yield
    plugins.discovered.cache_clear()


@pytest.mark.usefixtures("hostile")
def test_a_controller_that_raises_costs_only_its_episodes_and_ends_in_exit_code_1(
    command: Command, tmp_path: Path
) -> None:
    names = ("raises-in-act", "crashes", "virtual-signal", "traffic-light")
    chosen = [part for name in names for part in ("--controller", name)]
    done = command("run", "smoke/tee", *chosen, "--seeds", "1", "--workers", "1")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    found = {one["controller"]: one for one in records(tmp_path / "out")}
    assert [found[name]["status"] for name in names] == ["failed", "crashed", "ok", "ok"]
    reason = "act at 10 s raised ValueError: no idea\n[what] to do (hostile.py:"
    assert str(found["raises-in-act"]["reason"]).startswith(reason)
    assert found["raises-in-act"]["controller_from"].startswith("hostile 1.0.0 sha256:")
    assert "raises-in-act: 1 failed: act at 10" in done.stderr
    assert "[what] to do" in done.stderr
    assert "crashes: 1 crashed: the worker process died (SIGSEGV)" in done.stderr
    assert "virtual-signal" in done.stdout


@pytest.mark.usefixtures("hostile", "without_workers")
def test_refused_commands_are_reported_and_are_no_failure(command: Command) -> None:
    chosen = ("--controller", "commands-humans", "--seeds", "1")
    done = command("run", "smoke/tee", *chosen)
    assert done.returncode == 0
    assert "commands-humans: Go refused: the vehicle is not an RV" in done.stderr


@pytest.mark.usefixtures("hostile")
def test_list_says_which_controllers_are_broken_and_why(command: Command) -> None:
    done = command("list")
    assert (done.returncode, done.stderr) == (0, "")
    lines = {line.split()[0]: line for line in done.stdout.splitlines()}
    assert "broken" in lines["no-controller"]
    assert "is not a benchmark.control.controller.Controller" in lines["no-controller"]
    assert "broken" in lines["exits-on-import"]
    assert "SystemExit: set HOSTILE_HOME first" in lines["exits-on-import"]
    assert "Raises after ten seconds." in lines["raises-in-act"]
