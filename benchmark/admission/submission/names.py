"""Names that a board shows: of a declared alphabet, and none that looks like one that ships."""

import re
import unicodedata
from collections.abc import Iterable, Iterator

PART = "[A-Za-z0-9][A-Za-z0-9._-]*"
SCENARIO = re.compile(rf"{PART}(/{PART})?(@[0-9]{{1,6}}(\.[0-9]{{1,6}})?)?")
CONTROLLER = re.compile(r"[A-Za-z0-9_.:-]{1,200}(\?[A-Za-z0-9_.~/:,+%=&-]*)?")
LONGEST = 200  # characters
ALPHABET = "letters a to z, digits and ._- only"
ALIKE = (("rn", "m"), ("vv", "w"), ("0", "o"), ("1", "l"), ("i", "l"), ("5", "s"), ("_", "-"))


def skeleton(name: str) -> str:
    """Equal for names that people take for each other."""
    plain = unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold())
    for sign, other in ALIKE:
        plain = plain.replace(sign, other)
    return "".join(sign for sign in plain if sign.isprintable() and not sign.isspace())


def scenario_problems(names: Iterable[str], shipped: Iterable[str]) -> Iterator[str]:
    """What is wrong with scenarios' names.

    Args:
        names: of scenarios that records name, at a demand or not.
        shipped: those that ship.
    """
    known = {skeleton(name): name for name in shipped}
    for name in sorted(set(names)):
        if not SCENARIO.fullmatch(name) or len(name) > LONGEST:
            yield f"scenario {name[:LONGEST]!r}: {ALPHABET}, folder/name or folder/name@700"
            continue
        place, _, demand = name.partition("@")
        if demand and demand != f"{float(demand):g}":
            yield f'scenario "{name}": write {place}@{float(demand):g}'
        if (other := known.setdefault(skeleton(place), place)) != place:
            yield f'scenario "{name}": looks like {other}; rename the file'


def controller_problem(name: str, distribution: str, shipped: Iterable[str]) -> str | None:
    """What is wrong with a controller's name; None where nothing is.

    Args:
        name: with its options, as in records.
        distribution: where it says that it is from.
        shipped: the names of controllers that ship with this package.
    """
    if not CONTROLLER.fullmatch(name):
        return f"controller {name[:LONGEST]!r}: {ALPHABET}, and options as in NAME?key=value"
    head = name.partition("?")[0]
    for other in shipped:
        if head == other and distribution != "rightofway":
            return f'controller "{head}": a controller of that name ships; choose another name'
        if head != other and skeleton(head) == skeleton(other):
            return f'controller "{head}": looks like {other}, which ships; choose another name'
    return None
