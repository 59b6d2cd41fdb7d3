"""What a scenario file says: roads, demand, vehicles, signals; knows nothing of SUMO."""
