"""The picture of volumes: Fig. 1 of From and Gravdahl (2007)."""

from pathlib import Path

import numpy as np
import pytest
import redundancy as rd


def test_volumes(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    spin = rd.OrientationVolume.product([((0, 0, 1), -np.pi, np.pi)])
    cone = rd.OrientationVolume.cone(np.deg2rad(30), spin=1.0).reoriented([0.0, 1.0, 0.0, 0.0])
    figure = rd.plots.orientation_volumes(spin, cone, points=200)
    panels = figure.axes[:6]
    clouds = [np.stack(panel.collections[0]._offsets3d, axis=-1) for panel in panels]  # type: ignore[attr-defined]
    assert [cloud.shape for cloud in clouds] == [(200, 3)] * 6
    # A free spin is the z axis in both; z' stands still.
    np.testing.assert_allclose(clouds[0][:, :2], 0.0, atol=1e-15)
    np.testing.assert_allclose(np.abs(clouds[0][:, 2]), np.abs(clouds[1][:, 2]), atol=1e-15)
    np.testing.assert_allclose(clouds[2], np.tile([0.0, 0.0, 1.0], (200, 1)), atol=1e-15)
    # A cone: directions within it, also of the visualising quaternions, upwards or downwards by the sign of the spin.
    assert (clouds[5][:, 2] >= np.cos(np.deg2rad(30)) - 1e-12).all()
    length = np.linalg.norm(clouds[4], axis=1)
    assert (np.abs(clouds[4][:, 2]) >= length * np.cos(np.deg2rad(30)) - 1e-12).all()
    assert length.max() <= np.sin(0.5)
    cone.plot(tmp_path / "cone.png")
    assert (tmp_path / "cone.png").stat().st_size > 10_000
