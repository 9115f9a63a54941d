"""Orientation volumes against oracles made by others, dense searches, definitions and differences."""

import pickle
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from redundancy import quaternion

from tests.task.volumes import TURN, Volume, members, oracles, random_orientations, random_volume, within

KINDS = ["cone", "pyramid", "square", "line_x", "line_y", "product"]
VOLUMES, CASES = oracles()
HALF = np.pi / 2.0

# Recorded as 0, but a of 6 and b of -12 degrees are within 10 and 20: on no bound.
WRONG = {("pyramid_10_20", "inside"), ("pyramid_10_20", "inside, other sign")}


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case['volume']}: {case['label']}")
def test_oracle(case: dict[str, Any]) -> None:
    volume, q = VOLUMES[str(case["volume"])], np.asarray(case["quaternion"])
    found = volume.nearest(q)
    assert volume.contains(q) is case["member"]
    assert found.unique is case["nearest_unique"]
    assert found.distance == pytest.approx(case["distance"], rel=0.0, abs=1e-12)
    if case["nearest"] is not None:
        assert quaternion.angle(found.orientation, case["nearest"]) < 1e-7
    signed = volume.signed_distance(q)
    if (case["volume"], case["label"]) in WRONG:
        b = np.deg2rad(12.0)
        assert signed == pytest.approx(-np.arcsin(np.cos(b) * np.sin(np.deg2rad(4.0))), abs=1e-12)
    elif case["signed_distance"] is not None:
        assert signed == pytest.approx(case["signed_distance"], rel=0.0, abs=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_no_member_is_nearer(kind: str) -> None:
    rng = np.random.default_rng(KINDS.index(kind))
    for _ in range(30):
        volume = random_volume(rng, kind)
        made, asked = members(rng, volume, 1000), random_orientations(rng, 8)
        assert volume.distance(made).max() < 1e-13
        found = volume.nearest(asked)
        assert volume.distance(found.orientation).max() < 1e-13
        np.testing.assert_allclose(quaternion.angle(found.orientation, asked), found.distance, rtol=0.0, atol=1e-13)
        for q, distance in zip(asked, found.distance, strict=True):
            assert quaternion.angle(made, q).min() > distance - 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_reoriented(kind: str) -> None:
    rng = np.random.default_rng(10 + KINDS.index(kind))
    for _ in range(30):
        volume, (p, *asked) = random_volume(rng, kind), random_orientations(rng, 9)
        there, turned = volume.reoriented(p), quaternion.product(p, asked)
        np.testing.assert_allclose(there.distance(turned), volume.distance(asked), rtol=0.0, atol=5e-15)
        assert there.reoriented(quaternion.conjugate(p)).distance(asked) == pytest.approx(
            volume.distance(asked), abs=5e-15
        )


@pytest.mark.parametrize("kind", KINDS)
def test_both_signs_and_both_forms(kind: str) -> None:
    rng = np.random.default_rng(20 + KINDS.index(kind))
    volume, asked = random_volume(rng, kind), random_orientations(rng, 12).reshape(2, 6, 4)
    found, opposite, matrices = volume.nearest(asked), volume.nearest(-asked), volume.nearest(quaternion.matrix(asked))
    assert found.orientation.shape == (2, 6, 4)
    assert matrices.orientation.shape == (2, 6, 3, 3)
    assert found.unique.dtype == bool
    np.testing.assert_allclose(opposite.distance, found.distance, rtol=0.0, atol=2e-15)
    np.testing.assert_allclose(matrices.distance, found.distance, rtol=0.0, atol=5e-15)
    np.testing.assert_allclose(
        matrices.orientation[found.unique], quaternion.matrix(found.orientation)[found.unique], atol=1e-7
    )
    assert (np.sum(found.orientation * asked, axis=-1) >= 0.0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_membership_is_that_of_the_definition(kind: str) -> None:
    rng = np.random.default_rng(30 + KINDS.index(kind))
    for _ in range(10):
        volume = random_volume(rng, kind, euler=True)
        made = members(rng, volume, 1000)
        beside = quaternion.product(made, quaternion.about(rng.normal(size=(1000, 3)), rng.uniform(0.0, 0.1, 1000)))
        asked = np.concatenate([random_orientations(rng, 1000), made, beside])
        inside = volume.contains(asked)
        np.testing.assert_array_equal(inside, volume.distance(asked) <= 1e-12)
        # The angles have rounding of their own, which half turns and gimbals magnify: so well inside and well outside.
        assert inside[within(volume, asked, -1e-9)].all()
        assert (volume.distance(asked)[~within(volume, asked, 1e-9)] > 0.0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_signed_distance_is_a_ball(kind: str) -> None:
    """Inside no turn by less leaves the volume, a little more along the gradient does; outside it is the distance."""
    rng = np.random.default_rng(40 + KINDS.index(kind))
    for _ in range(30):
        volume = random_volume(rng, kind)
        asked = np.concatenate([volume.sample(10, 1), random_orientations(rng, 10)])
        signed, gradient = volume.signed_distance(asked, gradient=True)
        outside = signed > 0.0
        np.testing.assert_array_equal(signed[outside], volume.distance(asked)[outside])
        for q, s, g in zip(asked, signed, gradient, strict=True):
            if np.isfinite(s) and s < -1e-9 and volume.tilts != (np.pi,):
                around = quaternion.product(quaternion.about(rng.normal(size=(100, 3)), -s * (1.0 - 1e-9)), q)
                assert volume.contains(around, 1e-9).all()
                assert not volume.contains(quaternion.product(quaternion.about(g, 1e-6 - s), q), 1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_gradient(kind: str) -> None:
    rng, step, seen = np.random.default_rng(50 + KINDS.index(kind)), 1e-6, 0
    for _ in range(30):
        volume = random_volume(rng, kind)
        asked = np.concatenate([volume.sample(5, 2), random_orientations(rng, 10)])
        signed, gradient = volume.signed_distance(asked, gradient=True)
        for q, s, g in zip(asked, signed, gradient, strict=True):
            if not (np.isfinite(s) and abs(s) > 1e-3):
                continue
            w = rng.normal(size=3)
            before, after = (
                volume.signed_distance(quaternion.product(quaternion.about(w, angle), q)) for angle in (-step, step)
            )
            rate, smooth = (after - before) / (2.0 * step), abs(after + before - 2.0 * s) < 1e-8
            seen += smooth
            # Where the nearest changes, there are two of them.
            assert not smooth or rate == pytest.approx(g @ w / np.linalg.norm(w), abs=1e-5)
            assert abs(after - before) < 2.0 * step * (1.0 + 1e-6)
    assert seen > 200


SHARES = [
    Volume.cone(0.4),
    Volume.cone(2.0, spin=(-1.0, 2.0)),
    Volume.pyramid(0.5, 0.3),
    Volume.pyramid(0.5, 0.3, spin=0.7),
    Volume.pyramid(2.0, 2.2),
    Volume.pyramid(2.0, 2.2, spin=(-2.0, 2.0)),
    Volume.square(0.5, 0.3),
    Volume.square(1.2, 0.9),
    Volume.square(np.pi / 2.0, 0.5, spin=1.0),
    Volume.product([((0, 0, 1), -np.pi, np.pi), ((0, 1, 0), 0.2, 0.9), ((0, 0, 1), -1.0, 2.0)]),
    Volume.product([((1, 2, 3), -2.0, 1.0), ((0, 1, 0), -2.5, 2.0), ((1, 0, 1), -1.0, 2.0)]),
]


@pytest.mark.parametrize("volume", SHARES, ids=repr)
def test_share_and_samples(volume: Volume) -> None:
    """Count random orientations that are members, and samples in a part whose share is known."""
    n = 20_000
    counted = volume.contains(random_orientations(np.random.default_rng(1), n)).mean()
    assert abs(counted - volume.share) < 4.0 * np.sqrt(volume.share / n)
    drawn = volume.sample(n, 3)
    assert volume.distance(drawn).max() < 1e-13
    centre = volume.sample(1, 5)[0]
    ball = 0.6  # its share is (w - sin w) / pi
    of_ball = (ball - np.sin(ball)) / np.pi
    axis = random_orientations(np.random.default_rng(7), n)[:, 1:]
    uniform = np.random.default_rng(8).uniform(size=n) * of_ball * np.pi
    angle = np.interp(uniform, (grid := np.linspace(0.0, ball, 2001)) - np.sin(grid), grid)
    both = of_ball * volume.contains(quaternion.product(centre, quaternion.about(axis, angle))).mean()
    part = (quaternion.angle(drawn, centre) <= ball).mean()
    assert abs(part - both / volume.share) < 5.0 * (np.sqrt(part / n) + of_ball / volume.share / np.sqrt(n))


def test_shares_in_closed_form() -> None:
    assert Volume.cone(np.deg2rad(40), spin=(np.deg2rad(-30), np.deg2rad(50))).share == pytest.approx(
        0.0259951, abs=5e-8
    )
    assert Volume.pyramid(np.pi, HALF).share == 1.0
    assert Volume.square(HALF, HALF).share == 0.5
    assert Volume.cone(np.pi, spin=10.0).share == 1.0
    assert Volume.line_x(0.3).share == Volume.pyramid(0.3, 0.2, spin=(1, 1)).share == 0.0
    # Both ways to write a cone as rotations about z, y and z.
    assert Volume.product([((0, 0, 1), 0, 7), ((0, 1, 0), 0.0, 0.4), ((0, 0, 1), 0, 7)]).share == pytest.approx(
        Volume.cone(0.4).share, abs=1e-6
    )
    assert np.isnan(Volume.product([((0, 0, 1), 0, 1), ((0, 1, 0), 0, 1)] * 2).share)


def test_ten_degrees() -> None:
    """Corners of a square of 10 degrees are tilted by 14.2, those of a pyramid by 14.1; a cone keeps its own."""
    ten, rng = np.deg2rad(10.0), np.random.default_rng(0)
    for volume, most in ((Volume.cone(ten), 10.0), (Volume.square(ten, ten), 14.22), (Volume.pyramid(ten, ten), 14.11)):
        direction, _ = volume.pointing(members(rng, volume, 5000))
        assert np.rad2deg(np.arccos(direction[:, 2].min())) == pytest.approx(most, abs=0.01)


def test_half_turns() -> None:
    x, z = [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]
    cone = Volume.cone(0.3)
    assert cone.distance(x) == pytest.approx(np.pi - 0.3, abs=1e-15)
    assert not cone.nearest(x).unique
    assert cone.contains(z)
    assert Volume.cone(0.0).distance(x) == pytest.approx(np.pi, abs=1e-15)
    # The axis reversed, every spin fits.
    assert Volume.cone(np.pi, spin=0.1).contains(x)
    assert Volume.cone(np.pi, spin=0.1).contains(quaternion.about([1.0, 1.0, 0.0], np.pi))
    # Opposite to the middle of its range, both ends of the spin are as near.
    spun = Volume.cone(0.3, spin=0.5)
    assert spun.nearest(z).distance == pytest.approx(np.pi - 0.5)
    assert not spun.nearest(z).unique
    assert Volume.cone(0.3, spin=(np.pi, np.pi)).contains(z)
    assert Volume.cone(0.3, spin=(3.0, 3.3)).contains(quaternion.about([0, 0, 1], -3.1))
    assert Volume.pyramid(0.3, 0.2, spin=(np.pi - 0.1, np.pi + 0.1)).contains(
        quaternion.about([0, 0, 1], -np.pi + 0.05)
    )


def test_gimbal() -> None:
    """With b at a quarter turn a and c are one angle: whether it is a member depends on their sum alone."""
    pyramid = Volume.pyramid(0.2, HALF, spin=(0.0, 0.3))
    for a, c, inside in (
        (0.0, 0.4, True),
        (-0.2, 0.5, True),
        (0.4, 0.2, False),
        (0.1, -0.1, True),
        (-0.3, -0.1, False),
    ):
        q = quaternion.product(
            quaternion.product(quaternion.about([1, 0, 0], a), quaternion.about([0, 1, 0], HALF)),
            quaternion.about([0, 0, 1], c),
        )
        assert pyramid.contains(q) is (inside or -0.2 <= a + c <= 0.5)
    beyond = Volume.pyramid(0.1, 2.0, spin=0.1)
    q = quaternion.product(quaternion.about([1, 0, 0], 0.05), quaternion.about([0, 1, 0], 1.9))
    assert beyond.contains(q)
    assert not Volume.pyramid(0.1, 1.5, spin=0.1).contains(q)


def test_wide_ranges_are_free() -> None:
    rng = np.random.default_rng(2)
    asked = random_orientations(rng, 100)
    free, wide = Volume.cone(0.3), Volume.cone(0.3, spin=(1.0, 1.0 + TURN))
    assert wide.spin is None
    np.testing.assert_array_equal(free.distance(asked), wide.distance(asked))
    wider = Volume.product([((0, 0, 1), -5.0, 9.0)])
    assert wider.contains(quaternion.about([0, 0, 1], rng.uniform(-9, 9, 100))).all()


def test_degenerate_products() -> None:
    rng = np.random.default_rng(3)
    asked = random_orientations(rng, 200)
    z = (0.0, 0.0, 1.0)
    one, two = Volume.product([(z, -0.5, 0.8)]), Volume.product([(z, -0.2, 0.3), (z, -0.3, 0.5)])
    np.testing.assert_allclose(one.distance(asked), two.distance(asked), rtol=0.0, atol=1e-14)
    assert two.nearest(asked).unique.all()
    three = Volume.product([(z, -0.2, 0.3), ((0, 0, -2), -0.2, 0.1), (z, -0.2, 0.3)])
    np.testing.assert_allclose(one.distance(asked), three.distance(asked), rtol=0.0, atol=1e-14)
    flat = Volume.product([(z, -0.2, 0.3), (z, -0.3, 0.5), ((0, 1, 0), -1.0, 1.0)])
    pair = Volume.product([(z, -0.5, 0.8), ((0, 1, 0), -1.0, 1.0)])
    np.testing.assert_allclose(flat.distance(asked), pair.distance(asked), rtol=0.0, atol=1e-14)
    assert (one.freedoms, two.freedoms, three.freedoms, flat.freedoms, pair.freedoms) == (1, 1, 1, 2, 2)
    assert Volume.product([(z, 0.2, 0.2)]).freedoms == 0


def test_four_rotations_and_more() -> None:
    rng = np.random.default_rng(4)
    for _ in range(10):
        factors = [(rng.normal(size=3), *sorted(rng.uniform(-1.0, 1.0, 2))) for _ in range(rng.integers(4, 6))]
        volume = Volume.product(factors)
        made, asked = members(rng, volume, 2000), random_orientations(rng, 5)
        assert volume.distance(made[:20]).max() < 1e-12
        found = volume.nearest(asked)
        for q, distance in zip(asked, found.distance, strict=True):
            assert quaternion.angle(made, q).min() > distance - 1e-9


def test_visualising_quaternion() -> None:
    for volume in (Volume.cone(1.0), Volume.pyramid(0.4, 0.8, spin=2.0)):
        asked = volume.sample(200, 1)
        direction, spin = volume.pointing(asked)
        seen = volume.visualising(asked)
        np.testing.assert_allclose(direction, quaternion.rotate(asked, [0.0, 0.0, 1.0]), atol=1e-15)
        np.testing.assert_allclose(np.linalg.norm(seen[:, 1:], axis=1), np.abs(np.sin(spin / 2.0)), atol=1e-15)
        # Its sign, which (8) loses.
        np.testing.assert_allclose(
            2.0 * np.arctan2(np.sum(seen[:, 1:] * direction, axis=1), seen[:, 0]), spin, atol=1e-14
        )
        # Q_s Q_z Q_s* with the swing that is left of an orientation without its spin.
        turn = quaternion.about([0.0, 0.0, 1.0], spin)
        swing = quaternion.product(asked, quaternion.conjugate(turn))
        again = quaternion.product(quaternion.product(swing, turn), quaternion.conjugate(swing))
        np.testing.assert_allclose(quaternion.angle(again, seen), 0.0, atol=1e-14)


def test_grid_is_inside() -> None:
    for name, volume in VOLUMES.items():
        grid = volume.grid(3, 8, 5)
        assert volume.distance(grid).max() < 1e-12, name
    assert len(Volume.cone(0.2).grid(2, 6, 1)) == 13
    assert len(Volume.cone(0.2, spin=0.1).grid(2, 6, 3)) == 39
    assert len(Volume.line_x(0.2).grid(2, 6, 1)) == 5
    assert len(Volume.product([((0, 0, 1), 0, 1), ((0, 1, 0), 0, 1)]).grid(3, 4, 1)) == 12


def test_forms_of_one_and_none() -> None:
    volume = Volume.cone(0.3)
    assert volume.contains(np.zeros((0, 4))).shape == (0,)
    assert volume.nearest(np.zeros((2, 0, 3, 3))).orientation.shape == (2, 0, 3, 3)
    assert isinstance(volume.distance([1, 0, 0, 0]), float)
    assert volume.contains(np.eye(3)) is True
    strided = np.asfortranarray(random_orientations(np.random.default_rng(1), 600))[::2]
    np.testing.assert_array_equal(volume.distance(strided), volume.distance(strided.copy()))
    strided.flags.writeable = False
    assert volume.distance(strided).shape == (300,)


@pytest.mark.parametrize("name", VOLUMES)
def test_written_and_read(name: str) -> None:
    volume = VOLUMES[name]
    assert pickle.loads(pickle.dumps(volume)) == volume
    if "reference" not in repr(volume) and "reoriented" not in repr(volume):
        assert eval(f"rd.{volume!r}") == volume
    assert volume != Volume.cone(1.234)


def test_task_within() -> None:
    volume = Volume.cone(0.3, spin=1.0)
    task = rd.Task.within(volume)
    assert (task.kind, task.volume, task.dimension, task.target_size) == ("within", volume, 3, 12)
    assert task == rd.Task.within(volume)
    assert task != rd.Task.position()
    assert rd.Task.full().volume is None
    robot = rd.robots.get("panda")
    assert task.redundancy(robot) == (1, 3, 4)
    assert rd.Task.within(Volume.line_x(0.3)).redundancy(robot) == (1, 2, 3)
    with pytest.raises(rd.InvalidValueError, match="does not take one"):
        task.projector(robot, np.zeros(7))


BAD_VOLUMES = {
    "tilt is -0.1, expected 0 to pi": lambda: Volume.cone(-0.1),
    "tilt is NaN": lambda: Volume.cone(np.nan),
    "tilt_y is 4": lambda: Volume.pyramid(0.1, 4.0),
    "tilt_x is 2, expected 0 to pi/2": lambda: Volume.square(2.0, 0.1),
    "the lower first": lambda: Volume.cone(0.1, spin=(1.0, 0.0)),
    "spin is": lambda: Volume.cone(0.1, spin=-1.0),
    r"spin is \(0, inf\)": lambda: Volume.cone(0.1, spin=(0.0, np.inf)),
    "spin is array": lambda: Volume.cone(0.1, spin=np.zeros(3)),
    "0 rotations, expected 1 to 16": lambda: Volume.product([]),
    "an axis that is not zero": lambda: Volume.product([((0, 0, 0), 0, 1)]),
    r"a sequence of \(axis, low, high\)": lambda: Volume.product([1.0]),  # type: ignore[list-item]
    r"factors\[1\] is \(1, 0\)": lambda: Volume.product([((0, 0, 1), 0, 1), ((0, 0, 1), 1, 0)]),
}


@pytest.mark.parametrize("words", BAD_VOLUMES)
def test_bad_volumes(words: str) -> None:
    with pytest.raises(rd.InvalidValueError, match=words):
        BAD_VOLUMES[words]()


def test_bad_orientations() -> None:
    volume = Volume.cone(0.3)
    for shape in (np.zeros(3), np.zeros((2, 3)), np.float64(1.0), np.zeros((3, 4, 2))):
        with pytest.raises(rd.ShapeError, match="R: got shape"):
            volume.contains(shape)
    wrong: list[Any] = [np.zeros(4), [1.0, 0.1, 0.0, 0.0], np.diag([1.0, 1.0, -1.0]), np.full((3, 3), 0.5)]
    for asked in wrong:
        with pytest.raises(rd.InvalidValueError, match="R is"):
            volume.nearest(asked)
    with pytest.raises(rd.InvalidValueError, match=r"R\[1\] is \[2.0, 0.0, 0.0, 0.0\]"):
        volume.distance([[1, 0, 0, 0], [2, 0, 0, 0]])
    with pytest.raises(rd.NonFiniteError):
        volume.distance([np.nan, 0, 0, 0])
    with pytest.raises(rd.InvalidValueError, match="an array of real numbers"):
        volume.distance("upright")
    with pytest.raises(rd.InvalidValueError, match="tolerance is -1"):
        volume.contains([1, 0, 0, 0], -1.0)
    with pytest.raises(rd.InvalidValueError, match="tolerance is NaN"):
        volume.contains([1, 0, 0, 0], np.nan)
    with pytest.raises(rd.InvalidValueError, match="n is 100000000000, expected at most"):
        volume.sample(10**11)
    with pytest.raises(rd.InvalidValueError, match="expected at most 10000000"):
        volume.grid(10**8, 10**8, 10**8)
    with pytest.raises(rd.ShapeError):
        volume.reoriented(np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)))
    # Within 1e-6 of unit length it is scaled.
    assert volume.distance(np.array([1.0 + 5e-7, 0.0, 0.0, 0.0])) == 0.0
