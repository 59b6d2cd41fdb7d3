"""The results site: static pages from records alone, which open from a file without a network."""
