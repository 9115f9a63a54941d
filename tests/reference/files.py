"""Where the recorded references and the examples are."""

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"
EXAMPLES = ROOT / "examples"


def read_json(name: str) -> Any:
    """Return what a file of tests/data holds."""
    return json.loads((DATA / name).read_text(encoding="utf-8"))
