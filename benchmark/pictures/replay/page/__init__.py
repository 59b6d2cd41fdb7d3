"""The page that plays recorded episodes, alone or side by side; it needs no network."""
