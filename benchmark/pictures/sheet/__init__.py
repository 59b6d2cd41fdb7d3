"""Scenario -> drawing: the intersection from above, its turning counts and its signal program."""
