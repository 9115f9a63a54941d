"""Settings of the whole suite, and what several rooms are given."""

import pytest
import redundancy as rd
from hypothesis import settings

from tests.reference.helix import PATH, ROBOT

# The same examples on every machine: a failure on one is a failure on all.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def trajectory() -> rd.Trajectory:
    """The milled helix, followed with the least condition number."""
    return rd.follow(rd.OrthogonalSQP(ROBOT, rd.Task.axisymmetric(), rd.ConditionNumber(0.4855933, squared=True)), PATH)
