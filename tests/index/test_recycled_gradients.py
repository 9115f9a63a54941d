"""A gradient that nobody holds any more is handed out again: only then, and only as good as new."""

import numpy as np
from redundancy import JointLimits, Manipulability, robots

ROBOT = robots.get("ur5e")
POSTURES = ROBOT.random_postures(20, seed=3)


def test_gradients_that_are_kept_stay_as_they_are() -> None:
    index = Manipulability()
    kept = [index.evaluate(ROBOT, q, 1)[1] for q in POSTURES]
    again = [Manipulability().evaluate(ROBOT, q, 1)[1] for q in POSTURES]
    assert len({gradient.ctypes.data for gradient in kept}) == len(POSTURES)
    np.testing.assert_array_equal(kept, again)


def test_a_view_keeps_the_gradient_it_looks_at() -> None:
    index = Manipulability()
    views = [index.evaluate(ROBOT, q, 1)[1][2:4] for q in POSTURES]
    np.testing.assert_array_equal(views, [Manipulability().evaluate(ROBOT, q, 1)[1][2:4] for q in POSTURES])


def test_a_gradient_that_was_changed_comes_back_as_new() -> None:
    index = Manipulability()
    expected = Manipulability().evaluate(ROBOT, POSTURES[0], 1)[1]
    for change in ("flags", "shape"):
        for _ in range(3):
            gradient = index.evaluate(ROBOT, POSTURES[0], 1)[1]
            assert gradient.shape == (6,)
            assert gradient.flags.writeable
            np.testing.assert_array_equal(gradient, expected)
            if change == "flags":
                gradient.flags.writeable = False
            else:
                gradient.shape = (2, 3)


def test_one_objective_serves_robots_of_different_sizes() -> None:
    index = JointLimits()
    for name, n in (("ur5e", 6), ("panda", 7), ("ur5e", 6)):
        robot = robots.get(name)
        assert index.evaluate(robot, robot.middle, 1)[1].shape == (n,)
