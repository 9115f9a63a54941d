"""Sixty random jobs of `python -m tests.soak plans`: every robot, shape, kind of task and criterion."""

import pytest

from tests.reference.plan_checks import run
from tests.reference.plan_jobs import job
from tests.reference.plan_ways import confirmed

SMALL = """
2003 2008 2009 2013 2016 2017 2030 2034 2035 2038 2040 2041 2048 2059 2060 2064 2068 2079 2094 2097
2098 2099 2104 2108 2110 2111 2114 2115 2117 2118 2130 2132 2136 2140 2142 2143 2146 2150 2152 2154
2159 2161 2165 2185 2187 2195 2198 2200 2201 2210 2213 2225 2226 2230 2232 2234 2237 2248 2249 2256
"""
"""Jobs that take some milliseconds each."""
MENDED = "131 236 2077 2141 2360"
"""Jobs that were said to have no way: the best one is refused by the caller, another is too fast, or singular."""


@pytest.mark.parametrize("number", [int(number) for number in (SMALL + MENDED).split()])
def test_nothing_is_wrong(number: int) -> None:
    outcome = confirmed(run(job(0, number)))
    assert outcome.faults == [], outcome.job.name
