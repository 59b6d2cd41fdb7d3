"""The controllers that ship with Right of Way, each a plugin like anyone else's."""
