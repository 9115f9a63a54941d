"""The pages of docs/ that programs write to: where they are, tables, and the marks between which a table stands."""

import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
IMAGES = DOCS / "img"
HELIX_JOB = ROOT / "examples" / "helix_milling.toml"
SMALL_HELIX_JOB = ROOT / "examples" / "helix_small.toml"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def marked(name: str, text: str) -> str:
    """Return a text between its marks."""
    return f"<!-- {name} -->\n\n{text}\n\n<!-- end of {name} -->"


def replaced(page: str, name: str, part: str) -> str:
    """Return a page with a part in place of what stands between the marks of that name."""
    return re.sub(f"<!-- {name} -->.*<!-- end of {name} -->", lambda _: part, page, flags=re.DOTALL)


def show(page: Path, sections: Iterable[tuple[str, str]], write: bool) -> None:
    """Print texts between their marks as they come; with `write`, put them where their marks stand on a page."""
    content = page.read_text(encoding="utf-8")
    for name, text in sections:
        part = marked(name, text)
        sys.stdout.write(part + "\n\n")
        sys.stdout.flush()
        content = replaced(content, name, part)
    if write:
        page.write_text(content, encoding="utf-8")


def stale(sections: Iterable[tuple[Path, str]]) -> int:
    """Tell on stderr which pages do not show a text; return how many."""
    missing = [page.name for page, text in sections if text not in page.read_text(encoding="utf-8")]
    sys.stderr.write("".join(f"{name} does not show what its program prints\n" for name in missing))
    return len(missing)


def folder_of(arguments: Sequence[str]) -> Path:
    """Return the folder for pictures, made if it is missing: the first argument, or docs/img."""
    folder = Path(arguments[0]) if arguments else IMAGES
    folder.mkdir(parents=True, exist_ok=True)
    return folder
