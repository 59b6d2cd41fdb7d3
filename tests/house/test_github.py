"""The workflows and the action: valid, harmless whatever their inputs, and their commands exist."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from factories.comparisons import written
from factories.processes import PATIENCE
from factories.records import record
from factories.scenarios import ROOT, smoke

from benchmark.commands.app import app

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
ACTION = ROOT / ".github" / "actions" / "rightofway-regress" / "action.yml"
FILES = [*WORKFLOWS, ACTION]
BIN = Path(sys.executable).parent


def load(path: Path) -> Any:
    return yaml.safe_load(path.read_text())


def steps(path: Path) -> list[dict[str, Any]]:
    """All steps of a workflow or action."""
    document = load(path)
    if path == ACTION:
        return list(document["runs"]["steps"])
    return [step for job in document["jobs"].values() for step in job["steps"]]


EVERY = [
    pytest.param(step, id=f"{path.stem}-{step.get('name', step.get('uses', step.get('run')))}")
    for path in FILES
    for step in steps(path)
]


@pytest.mark.parametrize(
    ("kind", "paths"),
    [("workflows", WORKFLOWS), ("actions", [ACTION])],
    ids=["workflows", "action"],
)
def test_files_follow_githubs_schema(kind: str, paths: list[Path]) -> None:
    checker = [BIN / "check-jsonschema", "--builtin-schema", f"vendor.github-{kind}"]
    done = subprocess.run([*checker, *paths], capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("step", EVERY)
def test_no_expression_reaches_a_shell(step: dict[str, Any]) -> None:
    """What is put into a script is code; what is put into a variable is text."""
    assert "${{" not in step.get("run", "")


@pytest.mark.parametrize("step", EVERY)
def test_what_is_used_is_pinned_and_ours_is_there(step: dict[str, Any]) -> None:
    used = step.get("uses")
    if used is None:
        assert "run" in step
    elif used.startswith("./"):
        assert (ROOT / used / "action.yml").is_file()
    else:
        assert re.fullmatch(r"[\w.-]+/[\w./-]+@(v\d+(\.\d+)*|[0-9a-f]{40})", used)


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_a_workflow_may_only_read_and_ends_in_time(path: Path) -> None:
    document = load(path)
    assert document["permissions"] == {"contents": "read"}
    assert "pull_request_target" not in document[True]  # YAML's word for the key "on"
    assert all("permissions" not in job for job in document["jobs"].values())
    assert all(job["timeout-minutes"] <= 30 for job in document["jobs"].values())


@pytest.mark.parametrize("step", EVERY)
def test_the_commands_of_a_step_exist(step: dict[str, Any]) -> None:
    script = step.get("run", "")
    targets = re.findall(r"^([\w./-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert {*re.findall(r"^make (\S+)", script)} <= {*targets}
    for program in re.findall(r"\.venv/bin/(\S+)", script):
        assert (BIN / program).exists()
    commands = {
        command.callback.__name__ for command in app.registered_commands if command.callback
    }
    assert {*re.findall(r"rightofway (\w+)", script)} <= commands


def script(name: str) -> str:
    (found,) = (step["run"] for step in steps(ACTION) if step.get("name") == name)
    return str(found)


def inputs(name: str, **given: str) -> dict[str, str]:
    """The variables of a step, from the action's inputs and their defaults."""
    defaults = {key: entry["default"] for key, entry in load(ACTION)["inputs"].items()}
    (env,) = (step["env"] for step in steps(ACTION) if step.get("name") == name)
    values = defaults | {key.replace("_", "-"): value for key, value in given.items()}
    return {
        variable: values[re.fullmatch(r"\$\{\{ inputs\.([\w-]+) \}\}", expression)[1]]  # type: ignore[index]
        for variable, expression in env.items()
    }


STAND_IN = """#!{python} -S
import json, sys
with open({calls!r}, "a") as file:
    file.write(json.dumps(sys.argv[1:]) + "\\n")
"""


def recorded(folder: Path, program: str, name: str, **given: str) -> list[list[str]]:
    """The arguments of each call of a program that a script makes; a stand-in writes them down."""
    stand_in, calls, work = folder / "bin" / program, folder / "calls", folder / "work"
    stand_in.parent.mkdir()
    work.mkdir()
    stand_in.write_text(STAND_IN.format(python=sys.executable, calls=str(calls)))
    stand_in.chmod(0o755)
    done = bash(name, work, stand_in.parent, **given)
    assert (done.returncode, done.stderr) == (0, "")
    assert not list(work.iterdir())  # no input was taken for a command
    return [json.loads(line) for line in calls.read_text().splitlines()]


def bash(name: str, work: Path, programs: Path, **given: str) -> subprocess.CompletedProcess[str]:
    """Run a step's script as GitHub does."""
    own = {"PATH": f"{programs}:/usr/bin:/bin", "GITHUB_ACTION_PATH": str(ACTION.parent)}
    kept = {key: os.environ[key] for key in ("PYTHONPATH", "RIGHTOFWAY_CACHE") if key in os.environ}
    return subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script(name)],
        cwd=work,
        env=kept | own | inputs(name, **given),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )


DEFAULT = [
    *("regress", "--reference=results/reference", "--limit=5%", "--out=rightofway-regress"),
    *("--json=rightofway-regress/report.json", "--junit=rightofway-regress/report.xml"),
    "--markdown=rightofway-regress/report.md",
]
EVIL = """$(touch pwned) `touch pwned` "; touch pwned; ' * --help"""


def test_the_action_compares_with_its_defaults(tmp_path: Path) -> None:
    assert recorded(tmp_path, "rightofway", "Compare") == [DEFAULT]


def test_the_action_gives_lines_as_options(tmp_path: Path) -> None:
    (found,) = recorded(
        *(tmp_path, "rightofway", "Compare"),
        metrics="throughput\naverage_waiting_time\n",
        controllers="\n  \nvirtual-signal?green=5&clearance=4\n",
        scenarios="my scenarios/",
        suite="mine.toml",
    )
    assert found == [
        *DEFAULT,
        *("--metric=throughput", "--metric=average_waiting_time", "--scenario=my scenarios/"),
        *("--suite=mine.toml", "--controller=virtual-signal?green=5&clearance=4"),
    ]


def test_no_input_of_the_action_is_run(tmp_path: Path) -> None:
    names = ("reference", "limit", "metrics", "scenarios", "suite", "controllers", "reports")
    (found,) = recorded(tmp_path, "rightofway", "Compare", **dict.fromkeys(names, EVIL))
    options = ("reference", "limit", "out", "json", "junit", "markdown")
    more = ("metric", "scenario", "suite", "controller")
    assert [one.split("=", 1)[0] for one in found] == [
        "regress",
        *(f"--{x}" for x in options + more),
    ]
    assert all(one.split("=", 1)[1].startswith(EVIL) for one in found[1:])


def test_the_action_installs_itself_and_then_what_is_asked_for(tmp_path: Path) -> None:
    packages = f".\n\n{EVIL}\n--index-url=http://evil\n"
    own, others = recorded(tmp_path, "python", "Install", packages=packages)
    assert own[-3:] == ["--constraint", str(ROOT / "constraints.txt"), str(ROOT)]
    assert others[-4:] == ["--", ".", EVIL, "--index-url=http://evil"]


def test_the_action_installs_nothing_else_by_default(tmp_path: Path) -> None:
    assert len(recorded(tmp_path, "python", "Install")) == 1


@pytest.mark.parametrize(
    ("wait", "said", "code"),
    [(0.0, "1 worse", 1), pytest.param(999.0, "1 better", 0, marks=pytest.mark.slow)],
)
def test_the_action_ends_as_the_check_does_and_leaves_its_reports(
    tmp_path: Path, wait: float, said: str, code: int
) -> None:
    episode = {"scenario": "smoke/tee", "scenario_hash": smoke("tee").hash, "rate": None}
    records = [record("traffic-light", seed, wait, **episode) for seed in range(1, 8)]
    written(tmp_path / "ref", records)
    done = bash("Compare", tmp_path, BIN, reference="ref")
    assert (done.returncode, said in done.stdout) == (code, True)
    reports = tmp_path / "rightofway-regress"
    assert {path.name for path in reports.iterdir()} == {
        *("records", "report.json", "report.md", "report.xml"),
    }


def test_the_action_ends_with_exit_code_2_where_there_is_nothing_to_compare(tmp_path: Path) -> None:
    assert bash("Compare", tmp_path, BIN, reference="nowhere").returncode == 2
