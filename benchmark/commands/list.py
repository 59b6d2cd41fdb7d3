"""The command ``rightofway list``."""

from benchmark.commands import console


def list_installed() -> None:
    """List the shipped scenarios and suites and the installed controllers."""
    from rich.table import Table

    from benchmark.control import plugins
    from benchmark.plumbing.errors import ControllerError
    from benchmark.scenario import catalogue, scenario
    from benchmark.study.suite import load_suite, shipped_suites

    scenarios = Table("scenario", "title", box=None)
    for name, path in catalogue.shipped_scenarios().items():
        scenarios.add_row(name, console.literal(scenario.load_scenario(path).title))
    suites = Table("suite", "scenarios", "controllers", box=None)
    for column in suites.columns:
        column.overflow = "fold"  # references can be copied whole
    for name, path in shipped_suites().items():
        suite = load_suite(path)
        suites.add_row(name, ", ".join(suite.scenarios), ", ".join(suite.controllers))
    controllers = Table("controller", "rules", "description", "options", box=None)
    for name in plugins.discovered():
        try:
            kind = plugins.load_class(name)
        except ControllerError as error:
            controllers.add_row(name, "broken", console.literal(str(error)))
        else:
            options = ", ".join(plugins.options(kind))
            description = console.literal(plugins.description(kind))
            controllers.add_row(name, kind.rules, description, console.literal(options))
    for table in (scenarios, suites, controllers):
        console.stdout().print(table)
