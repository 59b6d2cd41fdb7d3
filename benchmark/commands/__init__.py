"""The command ``rightofway``: a file a subcommand, which parses, calls and prints."""
