"""The commands `rightofway site` and `rightofway serve`."""

import http.client
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from threading import Thread
from urllib.parse import urlsplit

import pytest
from browser import Visit
from factories.command_line import rightofway
from factories.processes import PATIENCE, first_line, without_sumo
from factories.records import record
from factories.scenarios import SCENARIOS, smoke

from benchmark.plumbing.errors import UsageError
from benchmark.records.store import Store
from benchmark.reports.site.server import site_server

COMMAND = [sys.executable, "-c", "from benchmark.commands.app import main; main()"]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with records in ``out`` and the site of them in ``site``."""
    folder = tmp_path_factory.mktemp("results")
    store = Store(folder / "out")
    store.prepare()
    for seed in (1, 2):
        for name in ("a", "b"):
            store.append(record(name, seed))
    done = rightofway(folder, "site")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "site/index.html: 7 pages from 4 records\n"
    return folder


@pytest.fixture
def port(results: Path) -> Iterator[int]:
    """Where the site is served."""
    with site_server(results / "site", 0) as running:
        thread = Thread(target=running.serve_forever)
        thread.start()
        yield running.server_port
        running.shutdown()
        thread.join(PATIENCE)


def ask(port: int, path: str, host: str = "localhost") -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    connection.request("GET", path, headers={"Host": host})
    return connection.getresponse()


def test_the_served_site_works_under_a_policy_that_lets_nothing_else_in(
    visit: Visit, port: int
) -> None:
    page = visit(f"http://127.0.0.1:{port}/")
    page.get_by_role("link", name="test/a").first.click()
    page.wait_for_selector(".canvas svg")
    page.wait_for_load_state("networkidle")  # the server ends before the browser
    served = {urlsplit(request).path for request in visit.requests}
    assert {"/", "/scenarios/test-a.html"} <= served


def test_all_that_a_browser_asks_for_at_once_is_answered(results: Path) -> None:
    with site_server(results / "site", 0) as slow, ExitStack() as open_ones:
        where = ("127.0.0.1", slow.server_address[1])
        asked = []
        for _ in range(40):  # before anybody answers, as on a busy machine
            client = open_ones.enter_context(socket.create_connection(where, PATIENCE))
            client.sendall(b"GET /index.html HTTP/1.0\r\nHost: 127.0.0.1\r\n\r\n")
            asked.append(client)
        thread = Thread(target=slow.serve_forever)
        thread.start()
        try:
            assert all(client.recv(12) == b"HTTP/1.0 200" for client in asked)
        finally:
            slow.shutdown()
            thread.join(PATIENCE)


def test_it_listens_to_this_machine_only(results: Path, port: int) -> None:
    with site_server(results / "site", 0) as other:
        assert other.server_address[0] == "127.0.0.1"
    assert ask(port, "/index.html").status == 200
    assert ask(port, "/", f"127.0.0.1:{port}").status == 200
    assert ask(port, "/", "evil.example").status == 403  # a name that was pointed at this machine


def test_nothing_but_the_files_of_the_site_is_shown(port: int) -> None:
    assert ask(port, "/scenarios/").status == 404
    for path in ("/../out/records/test-a.jsonl", "/%2e%2e/out/records/test-a.jsonl", "/nowhere"):
        assert ask(port, path).status == 404


def test_a_port_that_is_taken_is_named_with_the_remedy(results: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        number = taken.getsockname()[1]
        with pytest.raises(UsageError, match=rf"port {number} is taken .* another with --port"):
            site_server(results / "site", number)
        done = rightofway(results, "serve", "--port", str(number))
        assert done.returncode == 2
        assert f"port {number} is taken" in done.stderr


def test_serve_says_where_it_is_and_ends_quietly_with_ctrl_c(results: Path) -> None:
    with subprocess.Popen(
        [*COMMAND, "serve", "site", "--port", "0"], cwd=results, stdout=subprocess.PIPE, text=True
    ) as running:
        found = re.match(r"http://127\.0\.0\.1:(\d+)/", first_line(running))
        assert found
        assert ask(int(found[1]), "/").status == 200
        running.send_signal(signal.SIGINT)
        assert running.wait(timeout=PATIENCE) == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("serve", "nowhere"), ("nowhere: no site here", "rightofway site -o nowhere")),
        (("serve", "out"), ("out: no site here",)),
        (("site", "--records", "nowhere"), ("nowhere: no such folder", "rightofway run")),
        (("site", "-o", "out"), ("out: holds records", "another folder with --output")),
        (("site", "--scenario", "nowhere.toml"), ("nowhere.toml",)),
    ],
)
def test_bad_input_ends_in_exit_code_2_and_one_message(
    results: Path, arguments: tuple[str, ...], words: tuple[str, ...]
) -> None:
    done = rightofway(results, *arguments)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    said = " ".join(done.stderr.split())
    assert all(word in said for word in words), said


def test_a_folder_without_records_makes_an_empty_site(tmp_path: Path) -> None:
    (tmp_path / "out" / "records").mkdir(parents=True)
    done = rightofway(tmp_path, "site")
    assert done.returncode == 0
    assert "no records here" in done.stderr
    assert done.stdout == "site/index.html: 3 pages from 0 records\n"


def test_a_users_scenario_is_drawn_where_sumo_is_and_described_where_it_is_not(
    tmp_path: Path,
) -> None:
    mine = tmp_path / "mine" / "crossing.toml"
    mine.parent.mkdir()
    mine.write_text((SCENARIOS / "smoke" / "crossing.toml").read_text())
    store = Store(tmp_path / "out")
    store.prepare()
    scenario = smoke("crossing")
    store.append(record("a", scenario="mine/crossing", scenario_hash=scenario.hash))
    page = tmp_path / "site" / "scenarios" / "mine-crossing.html"

    assert rightofway(tmp_path, "site", "--scenario", "mine/crossing.toml").returncode == 0
    assert "Signal program" in page.read_text("utf-8")
    assert (tmp_path / "site" / "drawings" / "mine-crossing-plan.svg").is_file()

    shim = without_sumo(tmp_path / "shim")
    path = os.pathsep.join(filter(None, (str(shim), os.environ.get("PYTHONPATH"))))
    cache = str(tmp_path / "cache")
    done = subprocess.run(
        [*COMMAND, "site", "--scenario", "mine"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": path, "RIGHTOFWAY_CACHE": cache},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    assert "no drawing" in done.stderr
    assert "No drawing" in page.read_text("utf-8")
    assert not (tmp_path / "site" / "drawings").exists()
