"""Contents -> the pages: each one's template and what is in it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from benchmark.records import measures
from benchmark.records.flags import MARKS
from benchmark.records.leaderboard import Row
from benchmark.records.measures import BY_KEY
from benchmark.records.record import Record
from benchmark.records.statistics import CONFIDENCE, ENOUGH, RESAMPLES
from benchmark.reports.site import charts, methods
from benchmark.reports.site.contents import Contents, rates
from benchmark.reports.site.intervals import Scale
from benchmark.reports.site.model_card import describe
from benchmark.reports.site.pairs import COMPARED, Duel, Tally, duels_of, tally
from benchmark.reports.site.signal_program import program_steps

BOARD = (
    *("time_loss", "travel_time", "throughput", "collisions"),
    *("unregulated_lane_ratio", "refused_commands"),
)  # measures beside the headline


@dataclass(frozen=True)
class Page:
    """A page before it is rendered."""

    address: str
    template: str
    facts: Mapping[str, Any]


def pages(contents: Contents) -> Iterator[Page]:
    """All pages of the site."""
    duels = {pair: duels_of(contents, *pair) for pair in contents.pairs}
    tallies = {pair: tally(met) for pair, met in duels.items()}
    yield _overview(contents)
    for name, rows in contents.scenarios.items():
        yield _scenario(contents, name, rows)
    origins = methods.origins_of(contents.records)
    for name in contents.controllers:
        yield _controller(contents, name, origins[name], tallies)
    yield Page("pairs.html", "pairs.html", {"tallies": tallies, "title": "Pairs"})
    for pair, met in duels.items():
        yield _pair(contents, pair, met, tallies[pair])
    yield _methods(contents, origins)


def _overview(contents: Contents) -> Page:
    scenario = next(iter(contents.scenarios), None)
    own = rates(contents.scenarios[scenario]) if scenario else []
    return Page(
        "index.html",
        "overview.html",
        {
            "title": "Leaderboard",
            "scale": Scale.of(contents.rows),
            "columns": [BY_KEY[key] for key in BOARD],
            "default_scenario": scenario,
            "default_rate": own[len(own) // 2] if own else None,
            "marks": MARKS,
            "descriptions": {name: describe(name) for name in contents.controllers},
        },
    )


def _scenario(contents: Contents, name: str, rows: Sequence[Row]) -> Page:
    scenario = contents.files.get(rows[0].scenario_hash)
    ran = {row.controller for row in rows}
    names = [controller for controller in contents.controllers if controller in ran]
    figures = {
        (row.controller, row.rate): row.headline
        for row in rows
        if row.headline and row.rate is not None
    }
    members = [
        record for record in contents.records if record.scenario_hash == rows[0].scenario_hash
    ]
    chart = charts.by_rate(
        "Waiting against penetration rate",
        f"Average waiting time by penetration rate at {name}, a line per controller with its 95 % "
        "interval. The table below holds the same figures.",
        charts.line_looks([each for each in names if any(key[0] == each for key in figures)]),
        figures,
        axis="average waiting time [s]",
    )
    return Page(
        contents.addresses.scenario(name),
        "scenario.html",
        {
            "title": scenario.title if scenario else name,
            "name": name,
            "rows": rows,
            "scenario": scenario,
            "hash": rows[0].scenario_hash,
            "episodes": len(members),
            "drawings": contents.drawings.get(rows[0].scenario_hash, {}),
            "phases": list(program_steps(scenario.signal)) if scenario and scenario.signal else [],
            "programs": _programs(members),
            "controllers": names,
            "chart": chart,
            "replays": [
                replay for replay in contents.replays if members[0].scenario in replay.scenarios
            ],
        },
    )


def _programs(records: Sequence[Record]) -> dict[tuple[str, str], str]:
    """The signal programs that ran, by controller and intersection, in words; the newest counts."""
    return {
        (record.controller, junction): words
        for record in records
        for junction, words in (record.programs or {}).items()
    }


def _controller(
    contents: Contents,
    name: str,
    origin: methods.Origin,
    tallies: Mapping[tuple[str, str], Tally],
) -> Page:
    rows = [row for row in contents.rows if row.controller == name]
    figures = {
        (row.scenario, row.rate): row.headline
        for row in rows
        if row.headline and row.rate is not None
    }
    seen = list(dict.fromkeys(scenario for scenario, _ in figures))
    chart = charts.by_rate(
        "Waiting against penetration rate",
        f"Average waiting time of {name} by penetration rate, a line per scenario with its 95 % "
        "interval. The table below holds the same figures.",
        charts.line_looks(seen, shown=10),
        figures,
        axis="average waiting time [s]",
    )
    return Page(
        contents.addresses.controller(name),
        "controller.html",
        {
            "title": name,
            "name": name,
            "rows": rows,
            "scenarios": list(dict.fromkeys(row.scenario for row in rows)),
            "description": describe(name),
            "origin": origin,
            "chart": chart,
            "replays": [replay for replay in contents.replays if name in replay.controllers],
            "against": [
                (other, _seen_from(name, pair, counted))
                for pair, counted in tallies.items()
                for other in pair
                if name in pair and other != name
            ],
        },
    )


def _seen_from(name: str, pair: tuple[str, str], counted: Tally) -> Tally:
    if name == pair[0]:
        return counted
    return Tally(counted.second, counted.first, counted.undecided)


def _pair(contents: Contents, pair: tuple[str, str], duels: Sequence[Duel], counted: Tally) -> Page:
    first, second = pair
    figures = {(duel.scenario, duel.rate): duel.headline for duel in duels if duel.rate is not None}
    chart = charts.by_rate(
        "Difference against penetration rate",
        f"Difference in average waiting time, {first} minus {second}, paired by seed, by "
        "penetration rate, a line per scenario with its 95 % interval. Below zero the first "
        "waits less. The table below holds the same figures.",
        charts.line_looks(list(dict.fromkeys(duel.scenario for duel in duels)), shown=10),
        figures,
        axis=f"{first} minus {second} [s]",
        zero_line=True,
    )
    return Page(
        contents.addresses.pair(first, second),
        "pair.html",
        {
            "title": f"{first} and {second}",
            "first": first,
            "second": second,
            "duels": duels,
            "compared": COMPARED,
            "tally": counted,
            "chart": chart,
        },
    )


def _methods(contents: Contents, origins: Mapping[str, methods.Origin]) -> Page:
    return Page(
        "methods.html",
        "methods.html",
        {
            "title": "Methods",
            "measures": measures.MEASURES,
            "symbols": [(methods.mathml(latex), words) for latex, words in measures.SYMBOLS],
            "mean": methods.mathml(measures.MEAN.latex),
            "difference": methods.mathml(measures.DIFFERENCE.latex),
            "mean_words": measures.MEAN.words,
            "difference_words": measures.DIFFERENCE.words,
            "confidence": CONFIDENCE,
            "resamples": RESAMPLES,
            "enough": ENOUGH,
            "marks": MARKS,
            "versions": methods.counted_versions(contents.records),
            "records_hash": methods.hash_of_records(contents.records),
            "origins": list(origins.values()),
            "conditions": methods.conditions_of(contents.records),
        },
    )
