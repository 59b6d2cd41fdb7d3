"""Submissions: bundles of a controller's records, action logs and code, made and verified."""
