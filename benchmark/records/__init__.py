"""What episodes left behind: written, read, counted, compared; needs no SUMO."""
