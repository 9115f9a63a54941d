"""docs/reproduction_leger.md and the count of operations on docs/indices.md show what `evidence` computes."""

import pytest


def test_pages_show_what_is_computed() -> None:
    pytest.importorskip("matplotlib")
    from evidence.leger import reproduce

    assert reproduce.main(["--check"]) == 0
