"""Records become tables, plots, the site and regression reports; needs no SUMO."""
