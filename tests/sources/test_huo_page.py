"""docs/reproduction_huo.md shows what its program prints (`--check` of `evidence.huo.reproduce` looks at the rest)."""

from collections.abc import Callable

import pytest

from evidence import pages
from evidence.huo import reproduce

QUICK = (
    reproduce.puma,
    reproduce.errors,
    reproduce.sphere,
    reproduce.counts,
    reproduce.tests,
    reproduce.geometries,
    reproduce.dynamic,
)


@pytest.mark.parametrize("section", QUICK, ids=lambda section: str(section.__name__))
def test_page_shows_the_table(section: Callable[[], str]) -> None:
    page = reproduce.PAGE.read_text(encoding="utf-8")
    assert pages.marked(section.__name__, section()) in page


def test_page_has_a_place_for_each_table() -> None:
    page = reproduce.PAGE.read_text(encoding="utf-8")
    for section in reproduce.SECTIONS:
        assert page.count(f"<!-- {section.__name__} -->") == 1
        assert page.count(f"<!-- end of {section.__name__} -->") == 1
