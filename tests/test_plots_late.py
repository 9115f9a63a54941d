"""The door of the pictures: all else works without matplotlib and plotly, and every name leads somewhere."""

import subprocess
import sys

import pytest
from redundancy import plots

WITHOUT = """
import sys
sys.modules["matplotlib"] = sys.modules["plotly"] = None
import redundancy as rd, redundancy.cli
assert rd.plots.CAUSES[0] == "feasible"
try:
    rd.plots.overview
except ImportError as error:
    assert "pip install redundancy[plot]" in str(error)
else:
    raise AssertionError
"""


def test_the_package_needs_no_matplotlib() -> None:
    done = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_name_of_the_door() -> None:
    pytest.importorskip("matplotlib")
    assert dir(plots) == sorted(plots.__all__)
    for name in plots.__all__:
        assert getattr(plots, name) is not None
    # A function that hid a module of its name would come the first time only.
    assert callable(plots.spin_scan)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = plots.nothing
