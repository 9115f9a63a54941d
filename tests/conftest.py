"""Settings of the whole suite."""

from hypothesis import settings

# The same examples on every machine: a failure on one is a failure on all.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")
