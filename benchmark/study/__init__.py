"""One controller on one scenario with one seed gives a record; many of them, anywhere, resumed."""
