"""No test waits for ever: each wait for a process, a thread or a result has a bound."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from factories.scenarios import ROOT

APART = ("benchmarks", "plugins")
"""Programs of their own, and what misbehaves on purpose."""

FILES = [
    path
    for path in sorted((ROOT / "tests").rglob("*.py"))
    if not set(APART) & set(path.relative_to(ROOT / "tests").parts)
]
WAITS = {"wait", "communicate", "join", "result", "acquire"}
PROGRAMS = {"run", "check_call", "check_output", "call"}


def unbounded(source: str) -> Iterator[str]:
    """The calls that may wait for ever, with their lines."""
    for node in ast.walk(ast.parse(source)):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
            continue
        waits = node.func.attr in WAITS and not (node.args or node.keywords)
        starts = ast.unparse(node.func) in {f"subprocess.{name}" for name in PROGRAMS}
        if waits or (starts and "timeout" not in {keyword.arg for keyword in node.keywords}):
            yield f"{node.lineno}: {ast.unparse(node)}"


@pytest.mark.parametrize(
    ("source", "count"),
    [
        ("process.wait()", 1),
        ("process.wait(PATIENCE)", 0),
        ("thread.join()", 1),
        ("' '.join(words)", 0),
        ("subprocess.run(line, check=True)", 1),
        ("subprocess.run(line, timeout=PATIENCE)", 0),
        ("process.communicate(timeout=PATIENCE)", 0),
    ],
)
def test_waits_without_a_bound_are_told_from_others(source: str, count: int) -> None:
    assert len(list(unbounded(source))) == count


def test_every_wait_of_a_test_has_a_bound() -> None:
    assert len(FILES) > 100
    found = [f"{_name(path)}:{call}" for path in FILES for call in unbounded(path.read_text())]
    assert not found, "\n".join(found)


def _name(path: Path) -> str:
    return str(path.relative_to(ROOT))
