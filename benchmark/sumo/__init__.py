"""The only door to SUMO: roads, demand, lights, and a running simulation."""
