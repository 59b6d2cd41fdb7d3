"""Time windows on conflict stretches: a rule that nobody trained."""
