"""Recorded episodes as films for slides, drawn as the page that plays them draws them."""
