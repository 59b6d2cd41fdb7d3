"""A scenario in motion: see, referee, carry out, measure; who decides is no concern of it."""
