"""Records -> the paper's table and figures, ours beside its own. Nothing here needs SUMO."""
