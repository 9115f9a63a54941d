"""docs/reproduction_leger.md and the counts of operations on docs/indices.md are what `evidence` computes."""

import pytest


def test_pages_show_what_is_computed() -> None:
    pytest.importorskip("matplotlib")
    from evidence.leger import reproduce

    assert reproduce.main(["--check"]) == 0


def test_pages_quote_the_sums() -> None:
    """Sums that a page has in its sentences are those of the recount."""
    from evidence import flops, pages
    from evidence.leger import sums

    ledger = flops.count()
    counted = [ledger.upto("value", "gradient"), ledger.upto("value", "gradient", "Hessian")]
    page = (pages.DOCS / "indices.md").read_text(encoding="utf-8")
    shown = sums.sums() + flops.table(ledger)
    for number in ("1763", "2393", "3003", "23796", "24006", "22256", *map(str, counted)):
        assert number in page
        assert number in shown
