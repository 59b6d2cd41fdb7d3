"""BibTeX entries of scenarios, from what their files say of their sources."""

import re

from benchmark.scenario.scenario import Scenario

SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
}


def bibtex_entry(scenario: Scenario, version: str) -> str:
    """A ``@misc`` entry that names the scenario, its sources and its exact content.

    Args:
        scenario: what is cited.
        version: of Right of Way, whose records are shown.
    """
    place = scenario.intersection
    notes = [*(source.rstrip(".") for source in scenario.sources)]
    if place.latitude is not None and place.longitude is not None:
        notes.append(f"Position: {place.latitude:g}, {place.longitude:g}")
    fields = {
        "title": f"{{{_literal(scenario.title)}}}",
        "author": "{The Right of Way developers}",
        "howpublished": _literal(f"Scenario {scenario.name} of Right of Way {version}"),
        "note": _literal("; ".join([*notes, f"SHA-256 {scenario.hash}"])),
    }
    body = "".join(f"  {key} = {{{value}}},\n" for key, value in fields.items())
    return f"@misc{{{_key(scenario.name)},\n{body}}}\n"


def _literal(words: str) -> str:
    """Words as LaTeX prints them, on one line."""
    return "".join(SPECIAL.get(sign, sign) for sign in " ".join(words.split()))


def _key(name: str) -> str:
    return "rightofway-" + re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-").lower()
