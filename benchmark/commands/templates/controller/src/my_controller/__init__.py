"""A controller for Right of Way."""
