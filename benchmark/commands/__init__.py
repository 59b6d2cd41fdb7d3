"""The longer subcommands of ``rightofway``, a file each; ``benchmark.cli`` gathers them."""
