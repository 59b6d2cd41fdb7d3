"""The command ``rightofway signal``."""

import typer

from benchmark.commands import console
from benchmark.commands.options import OneScenario


def signal(scenario: OneScenario) -> None:
    """Propose a signal program from the turning counts, by Webster's method.

    Without one a scenario takes it as it is: >> my.toml.
    """
    import tomli_w

    from benchmark.scenario import catalogue
    from benchmark.sumo import network, webster
    from benchmark.sumo.saturation import degrees_of_saturation

    timed = catalogue.find_scenario(scenario)
    if timed.signal is not None:
        console.notice(
            f"{timed.name}: has a signal program; take it out before you append this one"
        )
    roads = network.build_network(timed)
    for intersection in roads.intersections:
        program = webster.propose_program(timed, intersection)
        where = f" at {intersection.id}" if len(roads.junctions) > 1 else ""
        typer.echo(
            f"# {timed.name}{where}: cycle {program.cycle:g} s, Webster's method on the peak counts"
        )
        degrees = degrees_of_saturation(timed, intersection, program)
        worst = max(degrees, key=degrees.__getitem__)
        typer.echo(f"# highest degree of saturation: {worst} {degrees[worst]:.2f}")
        document = program.model_dump(mode="json", exclude_defaults=True)
        typer.echo(tomli_w.dumps({"signal": {"kind": program.kind, **document}}), nl=False)
