"""The programme in a loop around an arm that MuJoCo simulates: `examples/mujoco_loop.py`, both robots, both paths."""

import importlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.reference.files import EXAMPLES

mujoco = pytest.importorskip("mujoco")

RUNS = [("panda", "line"), ("baxter_left", "taught")]


@pytest.fixture(scope="module")
def loop() -> Iterator[Any]:
    """Return the example as a module, which finds the other files of its folder as it does when it is run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(EXAMPLES)
        yield importlib.import_module("mujoco_loop")


@pytest.fixture(scope="module", params=RUNS, ids=["-".join(run) for run in RUNS])
def run(request: pytest.FixtureRequest, loop: Any) -> Any:
    """Return a run of the loop."""
    return loop.simulate(*request.param)


def test_the_simulated_arm_is_the_robot(run: Any, loop: Any) -> None:
    model = mujoco.MjModel.from_xml_string(run.model)
    data = mujoco.MjData(model)
    random = np.random.default_rng(0)
    for q in random.uniform(run.robot.q_min, run.robot.q_max, (10, run.robot.n)):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        frames = run.robot.link_frames(q)
        for k in range(run.robot.n):
            body = data.body(f"link {k}")
            np.testing.assert_allclose(body.xpos, frames[k, :3, 3], atol=1e-12)
            np.testing.assert_allclose(body.xmat.reshape(3, 3), frames[k, :3, :3], atol=1e-12)
        np.testing.assert_allclose(data.site("hand").xpos, run.robot.fk(q)[:3, 3], atol=1e-12)


def test_distances_are_those_that_mujoco_finds(run: Any, loop: Any) -> None:
    model = mujoco.MjModel.from_xml_string(run.model)
    data = mujoco.MjData(model)
    capsules = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE)
    ball = model.body("ball").geomadr[0]
    # The base does not count: no joint moves it away.
    moving = [int(geom) for geom in capsules if model.geom_bodyid[geom] != 0]
    scene = rd.Scene(run.robot, rd.capsules_along_links(run.robot, 0.06), {"ball": rd.Shape.sphere(loop.BALL)})
    for i in range(0, len(run.q), 2000):
        data.qpos[:] = run.q[i]
        data.mocap_pos[0] = run.ball[i]
        mujoco.mj_forward(model, data)
        theirs = min(mujoco.mj_geomDistance(model, data, geom, ball, 5.0, None) for geom in moving)
        scene.place("ball", run.ball[i])
        assert scene.distance(run.q[i]) == pytest.approx(theirs, abs=1e-6)
        assert run.distance[i] <= theirs + 1e-6


def test_the_arm_keeps_its_distance_at_every_step(run: Any, loop: Any) -> None:
    assert len(run.distance) == loop.SUBSTEPS * len(run.time) + 1
    assert run.distance.min() >= loop.SECURITY
    # It had to do something for that, at the forearm and at the goal.
    assert run.unavoided[:-1][run.tracking].min() < -0.03
    assert run.unavoided[:-1][run.blocked].max() < -0.1


def test_the_hand_follows_while_the_forearm_gives_way(run: Any) -> None:
    position, angle = run.position_error[run.tracking], run.angle_error[run.tracking]
    assert np.sqrt(np.mean(position**2)) < 1e-4
    assert position.max() < 5e-4
    assert angle.max() < 5e-4


def test_the_hand_waits_at_the_nearest_safe_pose_and_gets_there_when_it_can(run: Any) -> None:
    assert run.position_error[run.blocked] == pytest.approx(run.nearest, abs=5e-4)
    assert run.position_error[-1] < 1e-5
    assert run.angle_error[-1] < 1e-5


def test_limits_and_statuses(run: Any, loop: Any) -> None:
    robot = run.robot
    assert (run.q >= robot.q_min).all()
    assert (run.q <= robot.q_max).all()
    assert (np.abs(run.qd) <= robot.qd_max).all()
    assert (np.abs(run.rates) <= loop.SPEED_SHARE * robot.qd_max * (1.0 + 1e-12)).all()
    assert (np.abs(np.diff(run.rates, axis=0)) <= loop.DT * robot.qdd_max * (1.0 + 1e-9)).all()
    status = np.array(run.status)
    assert set(status) <= {"solved", "relaxed", "limited"}
    assert (status[run.blocked] == "relaxed").all()
    # At rest what is left of the twist is what the objective is worth.
    assert np.isin(status[-1000:], ["solved", "relaxed"]).all()


def test_drives_at_their_torque_do_not_take_the_arm_to_the_ball(loop: Any) -> None:
    run = loop.simulate("baxter_left", "taught", 4.0)
    assert run.torque == pytest.approx(1.0)
    assert run.distance.min() >= loop.SECURITY
