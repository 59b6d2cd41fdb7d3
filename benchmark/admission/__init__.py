"""May it take part? The conformance kit, and submissions made and verified."""
