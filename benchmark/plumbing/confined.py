"""Paths that come from elsewhere: whether they stay in the folder they are meant for."""

import re
import unicodedata
from collections.abc import Iterable
from pathlib import Path

LONGEST = 200  # characters
ELSEWHERE = frozenset('<>:"|?*\\')  # means something in paths of other systems
DEVICES = re.compile(r"(CON|PRN|AUX|NUL|CONIN\$|CONOUT\$|COM\d|LPT\d)(\..*)?", re.IGNORECASE)


def problem(name: str) -> str | None:
    """Why a relative path could lead out of its folder here or elsewhere; None if it cannot.

    Only what every system reads alike passes: parts of plain characters between forward slashes.
    """
    if not name or len(name) > LONGEST:
        return f"is empty or longer than {LONGEST} characters"
    if any(unicodedata.category(sign) in ("Cc", "Cf", "Cs") for sign in name):
        return "holds control characters"
    if name.startswith("/") or re.match("[A-Za-z]:", name):
        return "is absolute"
    for part in name.split("/"):
        if part == "..":
            return "leads out of its folder"
        if part in ("", ".") or part != part.strip() or part.endswith("."):
            return "has a part that is empty, or begins or ends in a space or dot"
        if found := sorted(ELSEWHERE & set(part)):
            return f"holds {found[0]}"
        if DEVICES.fullmatch(part):
            return f"names a device, {part}"
    return None


def may_lead_out(value: str) -> bool:
    """Whether a text, were it a path, could lead out of the folder where it is read."""
    parts = re.split(r"[/\\]", value)
    return value.startswith(("/", "\\", "~")) or ".." in parts or value[1:2] == ":"


def clash(names: Iterable[str]) -> str | None:
    """A name that some system takes for the same as another, or as a folder of another."""
    seen: set[str] = set()
    folders: set[str] = set()
    for name in names:
        key = _key(name)
        above = [str(one) for one in Path(key).parents][:-1]
        if key in seen or key in folders or not seen.isdisjoint(above):
            return name
        seen.add(key)
        folders.update(above)
    return None


def _key(name: str) -> str:
    """Equal for names that a system which ignores case or Unicode's forms takes for the same."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def inside(folder: Path, name: str) -> Path:
    """Where a path that passed lies in a folder, links followed.

    Raises:
        ValueError: it does not pass, or a link leads out of the folder; says why.
    """
    if found := problem(name):
        raise ValueError(found)
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise ValueError("leads out of its folder by a link")
    return path
