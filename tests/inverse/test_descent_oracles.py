"""The minimum of one joint and the sweeps of the five algorithms, beside what others computed."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.reference.one_joint import misses, random_cases

DATA = json.loads((Path(__file__).parents[1] / "data" / "coordinate_descent.json").read_text(encoding="utf-8"))
JOINTS, TRACES, ROBOTS = DATA["one_joint"]["cases"], DATA["descent"]["cases"], DATA["descent"]["robots"]


@pytest.mark.parametrize("case", JOINTS, ids=[f"{i}-{case['name'][:30]}" for i, case in enumerate(JOINTS)])
def test_one_joint(case: dict[str, Any]) -> None:
    names = ("current_position", "desired_position", "w_p", "w_o", "orientation_metric", "change_min", "change_max")
    found = rd.one_joint_minimum(
        case["joint"],
        case["axis"],
        case["origin"],
        current_orientation=case["current_quaternion"],
        desired_orientation=case["desired_quaternion"],
        **{name: case[name] for name in names},
    )
    assert abs(found.value - case["minimum"]) <= 1e-12 * (1 + case["minimum"])
    if case["flat"]:
        assert found.change == 0.0
    else:
        assert min(abs(found.change - x) for x in case["minimisers"]) <= 1e-12


def robot_of(name: str, limits: bool) -> rd.Robot:
    table = ROBOTS[name]
    tool = np.eye(4)
    tool[2, 3] = table["tool_z"]
    bounds = {"q_min": table["q_min"], "q_max": table["q_max"]} if limits else {}
    theta = table.get("theta", [0.0] * len(table["a"]))
    return rd.Robot.from_dh(table["a"], table["d"], table["alpha"], theta, table["joints"], tool=tool, **bounds)


def settings(case: dict[str, Any]) -> dict[str, Any]:
    """Return what the package calls the algorithm of a trace."""
    name = case["algorithm"]
    known: dict[str, dict[str, Any]] = {
        "gauss_southwell_cost": {"algorithm": 2},
        "gauss_southwell_rate": {"algorithm": 3},
        "weighted": {"algorithm": 4, "weights": case["W"], "step": case["w_s"]},
    }
    other = {"algorithm": 5, "rule": name.removeprefix("gradient_"), "weights": case["W"]}
    found = known.get(name, other if name.startswith("gradient") else {"algorithm": 1, "order": name})
    if elbow := case.get("elbow"):
        found["points"] = [(elbow["frame_after_joint"], elbow["point"], elbow["goal"], elbow["w_r"])]
    return found


@pytest.mark.parametrize("case", TRACES, ids=[f"{i}-{c['robot']}-{c['algorithm']}" for i, c in enumerate(TRACES)])
def test_trace(case: dict[str, Any]) -> None:
    robot = robot_of(case["robot"], case["limits"])
    weights = {"w_p": case["w_p"], "w_o": case["w_o"]}
    descent = rd.CoordinateDescent(robot, robot.fk(case["q_target"]), **weights, **settings(case))
    trace = descent.trace(case["q0"], 5)
    assert np.abs(trace.cost - case["cost"]).max() <= 1e-10
    assert np.abs(trace.q[1] - case["q_after_1"]).max() <= 1e-10
    assert np.abs(trace.q[5] - case["q_after_5"]).max() <= 1e-10
    assert trace.picks.tolist() == (case["picks"] or [[]] * 5)
    q, cost = descent.sweep(case["q0"])
    assert np.array_equal(q, trace.q[1])
    assert cost == trace.cost[1]


def test_every_kind_of_joint_beside_a_scan() -> None:
    for value, there in (misses(random_cases(np.random.default_rng(seed), 1000)) for seed in (10, 11)):
        assert value.max() <= 1e-12
        assert there.max() <= 1e-12
