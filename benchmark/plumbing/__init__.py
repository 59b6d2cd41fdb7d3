"""What any program needs and no traffic engineer: errors, messages, files, processes, Ctrl-C."""
