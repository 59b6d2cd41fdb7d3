"""Weights in files: whole and of the right network, or one clear message."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from factories.processes import PATIENCE
from factories.scenarios import smoke
from safetensors.numpy import save_file

from baselines.wang import controller
from baselines.wang.policy import HIDDEN, shapes
from benchmark.learning.weights import digest, load, save
from benchmark.plumbing.errors import ControllerError
from benchmark.study.episode import Episode, run_episode

SHAPES = {"a": (3, 2), "b": (4,)}
REMEDY = "train again"


def arrays(wanted: dict[str, tuple[int, ...]], seed: int = 0) -> dict[str, np.ndarray]:
    random = np.random.default_rng(seed)
    return {
        name: random.normal(size=shape).astype(np.float32) / 10 for name, shape in wanted.items()
    }


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "w.safetensors"
    save(path, arrays(SHAPES), {"seed": 3, "settings": {"x": [1, 2]}})
    return path


def test_what_was_saved_is_loaded_bit_for_bit(file: Path) -> None:
    found = load(file, SHAPES, REMEDY)
    for name, array in arrays(SHAPES).items():
        assert np.array_equal(found.arrays[name], array)
    assert found.notes == {"seed": 3, "settings": {"x": [1, 2]}}
    assert found.hash == digest(arrays(SHAPES))


def test_the_digest_tells_contents_names_and_shapes_apart_but_not_their_order() -> None:
    one = arrays(SHAPES)
    assert digest(one) == digest(dict(reversed(one.items())))
    others = [
        arrays(SHAPES, seed=1),
        {"a": one["a"].T, "b": one["b"]},
        {"a": one["a"], "c": one["b"]},
        {"a": one["a"]},
    ]
    assert len({digest(one), *(digest(other) for other in others)}) == 5


def refusal(path: Path, wanted: dict[str, tuple[int, ...]] = SHAPES) -> str:
    with pytest.raises(ControllerError) as caught:
        load(path, wanted, REMEDY)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert message.endswith(REMEDY)
    assert "\n" not in message
    return message


def test_missing_empty_and_damaged_files_are_refused(file: Path, tmp_path: Path) -> None:
    assert "cannot read the weights: No such file" in refusal(tmp_path / "none.safetensors")
    whole = file.read_bytes()
    for content in (b"", b"nonsense", whole[:20], whole[:-4], b"\xff" * len(whole)):
        file.write_bytes(content)
        assert "not a whole safetensors file" in refusal(file)


def test_a_flipped_bit_is_noticed_wherever_it_is_in_the_data(file: Path) -> None:
    whole = file.read_bytes()
    start = 8 + int.from_bytes(whole[:8], "little")  # after the header's length and the header
    assert len(whole) - start == 4 * (6 + 4)
    for place in range(start, len(whole)):
        content = bytearray(whole)
        content[place] ^= 1
        file.write_bytes(content)
        assert "do not match the SHA-256 noted in the file" in refusal(file)


@pytest.mark.parametrize(
    ("whole", "damaged"),
    [(b'"notes":', b'"mates":'), (b'"notes":"{', b'"notes":"['), (b" 3, ", b" ?, ")],
)
def test_damaged_notes_are_refused_like_damaged_data(
    whole: bytes, damaged: bytes, file: Path
) -> None:
    content = file.read_bytes()
    assert content.count(whole) == 1
    file.write_bytes(content.replace(whole, damaged))
    assert "the notes in the file are damaged" in refusal(file)


def test_weights_without_our_notes_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "foreign.safetensors"
    save_file(arrays(SHAPES), path)
    assert "do not match the SHA-256" in refusal(path)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ({**SHAPES, "a": (3, 5)}, r"a is (3, 2), expected (3, 5)"),
        ({**SHAPES, "c": (1,)}, "c is missing, expected (1,)"),
        ({"a": (3, 2)}, "b is (4,), expected none"),
    ],
)
def test_weights_of_another_network_are_refused(
    file: Path, wanted: dict[str, tuple[int, ...]], message: str
) -> None:
    assert f"weights of another network: {message}" in refusal(file, wanted)


def test_a_controller_with_weights_for_another_observation_says_so(tmp_path: Path) -> None:
    path = tmp_path / "wang.safetensors"
    save(path, arrays(shapes("extended", HIDDEN, 51)), {})
    with pytest.raises(
        ControllerError, match=r"trunk\.0\.weight is \(512, 126\), expected \(512, 97\)"
    ):
        controller.Wang(path)


def test_an_episode_with_damaged_weights_ends_in_that_message(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(controller, "SHIPPED", tmp_path)
    with pytest.raises(ControllerError, match=r"cannot read the weights: No such file.*reinstall"):
        run_episode(Episode(smoke("crossing"), "wang", 0.5, 1))


@pytest.mark.parametrize("damage", ["empty", "garbage", "truncated", "changed"])
def test_an_episode_with_a_damaged_file_names_it_and_the_remedy(
    damage: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "wang.safetensors"
    save(path, arrays(shapes("paper", HIDDEN, 51)), {})
    whole = path.read_bytes()
    changed = whole[:-1] + bytes([whole[-1] ^ 1])
    contents = {"empty": b"", "garbage": b"nonsense", "truncated": whole[:-4], "changed": changed}
    path.write_bytes(contents[damage])
    monkeypatch.setattr(controller, "SHIPPED", tmp_path)
    with pytest.raises(ControllerError, match="reinstall rightofway, or train") as caught:
        run_episode(Episode(smoke("crossing"), "wang", 0.5, 1))
    assert str(path) in str(caught.value)


def test_the_command_says_once_that_its_weights_are_damaged(tmp_path: Path) -> None:
    """In a copy of the packages, so that nothing that is installed gets damaged."""
    root = Path(controller.__file__).parents[2]
    for package in ("benchmark", "baselines", "scenarios"):
        if (root / package).is_dir():
            shutil.copytree(root / package, tmp_path / package)
    path = tmp_path / "baselines" / "wang" / "weights" / "wang.safetensors"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(b"nonsense")
    done = subprocess.run(
        [
            *(sys.executable, "-c", "from benchmark.commands.app import main; main()"),
            *("run", "smoke/crossing", "--controller", "wang", "--rate", "0.5", "--seeds", "1"),
            *("--out", str(tmp_path / "out")),
        ],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    said = " ".join(done.stderr.split())
    assert done.returncode == 1, said  # an episode failed
    assert said.count(f"{path}: not a whole safetensors file") == 1
    assert "reinstall rightofway, or train" in said
    assert "Traceback" not in said
