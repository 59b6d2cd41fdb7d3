"""The command ``rightofway schema``."""

import json

import typer


def schema() -> None:
    """Print the JSON Schema of scenario files, for editors."""
    from benchmark.scenario.scenario import json_schema

    typer.echo(json.dumps(json_schema(), indent=2))
