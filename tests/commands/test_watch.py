"""``rightofway watch`` says at once where nothing can be shown."""

import socket
from pathlib import Path

import pytest
from factories.command_line import rightofway

from benchmark.commands import watch

WORDS = ("watch", "smoke/tee", "--controller", "first-come")


@pytest.mark.parametrize("display", [":98765", "unix:98764.0", "localhost:59", "nonsense", "a:b"])
def test_a_display_that_does_not_answer_is_said_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, display: str
) -> None:
    monkeypatch.setenv("DISPLAY", display)
    done = rightofway(tmp_path, *WORDS)
    assert done.returncode == 2
    assert f'none answers at DISPLAY "{display}"' in done.stderr
    assert "rightofway replay" in done.stderr


def test_no_display_at_all_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert "neither DISPLAY nor WAYLAND_DISPLAY is set" in rightofway(tmp_path, *WORDS).stderr


def test_a_display_that_answers_is_taken() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as server:
        for number in range(60, 200):
            try:
                server.bind(("127.0.0.1", 6000 + number))
                break
            except OSError:
                continue
        server.listen()
        watch._require_screen(f"127.0.0.1:{number}", None)
