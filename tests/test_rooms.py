"""Who may use whom: the imports of both halves against the table of rooms in CONTRIBUTING.md.

A room may use those that its row names and what these may use, and a module none that uses it. Imports inside functions
count; those for types alone do not, except in a door, which names there what it imports late.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TABLE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
PYTHON, RUST = "python/redundancy/", "rust/src/"

# Files that are not in their room yet.
FLAT = {
    **dict.fromkeys(("planning", "maps", "_plan_*", "_layers", "_spare", "_path_frames"), "planning"),
    **dict.fromkeys(("_rows", "_spin", "_transport"), "_util"),
}


@dataclass(frozen=True)
class Use:
    """One module uses another, and a name in it if one is imported."""

    user: str
    used: str
    name: str | None = None


def arrows(table: str, folder: str) -> dict[str, set[str]]:
    """Return what each room of a folder may use, itself included; a row names those above it only."""
    allowed = dict[str, set[str]]()
    for row, names in re.findall(rf"^\| `{re.escape(folder)}([\w./]+)` \| ([\w, ]*)\|", table, re.MULTILINE):
        own = Path(row).stem
        assert own not in allowed, f"two rows for {own}"
        allowed[own] = {own}.union(*(allowed[name.strip()] for name in names.split(",") if name.strip()))
    return allowed


def room(module: str) -> str:
    """Return the room of a module, which is named by dots from the top of its half."""
    first = module.split(".")[0]
    return next((home for pattern, home in FLAT.items() if fnmatch(first, pattern)), first)


def python_uses(top: Path) -> list[Use]:
    """Return the imports within a package."""
    files = {".".join(file.relative_to(top).with_suffix("").parts): file for file in sorted(top.rglob("*.py"))}
    names = {name if name == "__init__" else name.removesuffix(".__init__") for name in files} | {"_core"}
    return [use for name, file in files.items() for use in _uses_of(top.name, name, file, names)]


def _uses_of(package: str, name: str, file: Path, modules: set[str]) -> Iterator[Use]:
    door = name.endswith("__init__")
    user = name if name == "__init__" else name.removesuffix(".__init__")
    folder = name.split(".")[:-1]
    for node in _imports(ast.parse(file.read_text(encoding="utf-8")), door):
        if isinstance(node, ast.Import):
            known = [alias.name.split(".")[1:] for alias in node.names if alias.name.split(".")[0] == package]
            yield from (Use(user, ".".join(parts) or "__init__") for parts in known)
            continue
        parts = (node.module or "").split(".") if node.module else []
        if node.level:
            base = folder[: len(folder) - node.level + 1] + parts
        elif parts[:1] == [package]:
            base = parts[1:]
        else:
            continue
        for alias in node.names:
            inner = ".".join([*base, alias.name])
            yield Use(user, inner) if inner in modules else Use(user, ".".join(base) or "__init__", alias.name)


def _imports(node: ast.AST, door: bool) -> Iterator[ast.Import | ast.ImportFrom]:
    """Return the imports anywhere in a file."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child
        elif isinstance(child, ast.If) and ast.unparse(child.test).endswith("TYPE_CHECKING") and not door:
            yield from _imports(ast.Module(child.orelse, []), door)
        else:
            yield from _imports(child, door)


def rust_uses(top: Path) -> list[Use]:
    """Return who names whom by a path from the crate or by way of a parent."""
    uses = []
    for file in sorted(top.rglob("*.rs")):
        path = list(file.relative_to(top).with_suffix("").parts)
        path = path[:-1] if path[-1] in ("mod", "lib") else path
        if not path:
            continue  # lib.rs names every room
        code = re.sub(r"//.*", "", file.read_text(encoding="utf-8"))
        code = re.sub(r"\b((?:super::){%d})(?=\w|\{)" % len(path), "crate::", code)  # noqa: UP031
        for found in re.finditer(r"\bcrate::(?:([a-z]\w*)(?=::|;|,|\s)|\{)", code):
            heads = [found[1]] if found[1] else _heads(code[found.end() :])
            uses += [Use(".".join(path), head) for head in heads]
    return uses


def _heads(code: str) -> list[str]:
    """Return the first parts of the paths in braces, which were opened just before."""
    heads, depth, flat = list[str](), 0, ""
    for letter in code:
        depth += {"{": 1, "}": -1}.get(letter, 0)
        if depth < 0:
            break
        flat += letter if depth == 0 else ""
    heads += [head for part in flat.split(",") if (head := part.strip().split("::")[0])]
    return [head for head in heads if head[0].islower()]


def against(uses: list[Use], allowed: dict[str, set[str]]) -> list[str]:
    """Return the uses that have no arrow, or of a room that is in no row, and names that are a room's own."""
    wrong = []
    for use in uses:
        user, used = room(use.user), room(use.used)
        arrow = f"{use.user} uses {use.used}"
        if missing := [name for name in (user, used) if name not in allowed]:
            wrong.append(f"{arrow}: no row for {missing[0]}")
        elif used not in allowed[user]:
            wrong.append(f"{arrow}: no arrow from {user} to {used}")
        elif user != used and use.name is not None and re.match("_[^_]", use.name):
            wrong.append(f"{arrow}: {use.name} is its own")
    return wrong


def circles(uses: list[Use]) -> list[list[str]]:
    """Return a circle of modules for each module from which one was found first."""
    after: dict[str, list[str]] = {}
    for use in uses:
        after.setdefault(use.user, []).append(use.used)
    found, done = list[list[str]](), set[str]()

    def walk(module: str, way: list[str]) -> None:
        if module in way:
            found.append([*way[way.index(module) :], module])
        elif module not in done:
            for following in after.get(module, []):
                walk(following, [*way, module])
            done.add(module)

    for module in after:
        walk(module, [])
    return found


def test_python_rooms_use_those_above_them() -> None:
    uses, allowed = python_uses(ROOT / PYTHON), arrows(TABLE, PYTHON)
    assert len(uses) > 200
    assert against(uses, allowed) == []
    assert circles(uses) == []


def test_rust_rooms_use_those_above_them() -> None:
    uses, allowed = rust_uses(ROOT / RUST), arrows(TABLE, RUST)
    assert len(uses) > 100
    assert against(uses, allowed) == []


def test_every_room_has_a_row_and_every_row_a_room() -> None:
    for folder in (PYTHON, RUST):
        table = arrows(TABLE, folder)
        there = {path.stem for path in (ROOT / folder).iterdir() if path.name not in ("__pycache__", "lib.rs")}
        rooms = {room(name) for name in there if not name.startswith((".", "_core.")) and name != "py"}
        assert rooms - set(table) == set()
        assert set(table) - rooms - {"_core"} == set()


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Return a package in order: a door, an import in a function, one for types alone, one of a folder from inside."""
    top = tmp_path / "house"
    for name, text in {
        "__init__": "from .roof import tiles",
        "ground/__init__": "from .stone import lay",
        "ground/stone": "import os\ndef lay(): ...",
        "wall": "import typing\nif typing.TYPE_CHECKING:\n    from .roof import tiles\nfrom .ground import lay",
        "roof/__init__": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .tiles import tiles",
        "roof/tiles": "def tiles():\n    from .. import wall\n    import house.ground.stone",
    }.items():
        (top / name).parent.mkdir(parents=True, exist_ok=True)
        (top / f"{name}.py").write_text(text, encoding="utf-8")
    return top


HOUSE = """
| `house/ground/` | | words |
| `house/wall.py` | ground | words |
| `house/fence.py` | ground | words |
| `house/roof/` | wall | words |
| `house/__init__.py` | roof, fence | words |
"""


def test_what_is_in_order_passes(package: Path) -> None:
    allowed, uses = arrows(HOUSE, "house/"), python_uses(package)
    assert list(allowed) == ["ground", "wall", "fence", "roof", "__init__"]
    assert allowed["roof"] == {"ground", "wall", "roof"}
    assert set(uses) == {
        Use("__init__", "roof.tiles"),
        Use("ground", "ground.stone", "lay"),
        Use("wall", "ground", "lay"),
        Use("roof", "roof.tiles", "tiles"),
        Use("roof.tiles", "wall"),
        Use("roof.tiles", "ground.stone"),
    }
    assert against(uses, allowed) == []
    assert circles(uses) == []


@pytest.mark.parametrize(
    "text",
    [
        "from ..roof import tiles",
        "from ..roof.tiles import tiles",
        "from .. import roof",
        "import house.roof",
        "from house.roof import tiles",
        "def lay():\n    from ..roof import tiles",
        "class Stone:\n    def lay(self):\n        if self:\n            from ..roof import tiles",
    ],
)
def test_an_arrow_turned_round_fails(package: Path, text: str) -> None:
    (package / "ground" / "stone.py").write_text(text, encoding="utf-8")
    uses = python_uses(package)
    (message,) = against(uses, arrows(HOUSE, "house/"))
    assert message.startswith("ground.stone uses roof")
    assert message.endswith("no arrow from ground to roof")
    assert circles(uses) != []


def test_a_circle_in_one_room_fails(package: Path) -> None:
    (package / "ground" / "stone.py").write_text("def lay():\n    from . import sand", encoding="utf-8")
    (package / "ground" / "sand.py").write_text("from .stone import lay", encoding="utf-8")
    assert against(python_uses(package), arrows(HOUSE, "house/")) == []
    assert circles(python_uses(package)) == [["ground.stone", "ground.sand", "ground.stone"]]


def test_a_name_of_another_room_that_is_its_own_fails(package: Path) -> None:
    (package / "wall.py").write_text("from .ground.stone import _mortar", encoding="utf-8")
    assert against(python_uses(package), arrows(HOUSE, "house/")) == ["wall uses ground.stone: _mortar is its own"]


def test_rooms_side_by_side_have_no_arrow(package: Path) -> None:
    (package / "fence.py").write_text("from . import wall", encoding="utf-8")
    assert against(python_uses(package), arrows(HOUSE, "house/")) == ["fence uses wall: no arrow from fence to wall"]


def test_a_room_without_a_row_fails(package: Path) -> None:
    (package / "cellar.py").write_text("from .ground import lay", encoding="utf-8")
    assert against(python_uses(package), arrows(HOUSE, "house/")) == ["cellar uses ground: no row for cellar"]


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("use crate::linalg::{size, Row};\nuse super::Joint;", 0),
        ("// use crate::plan::Plan;", 0),
        ("use crate::{linalg::Row, MAX};", 0),
        ("use crate::plan::Plan;", 1),
        ("use crate::{linalg::{size, Row}, plan::{self, Plan}};", 1),
        ("fn f() -> crate::plan::Plan { todo!() }", 1),
        ("use super::super::plan::Plan;", 1),
        ("use crate::plan;", 1),
    ],
)
def test_rust_arrows(tmp_path: Path, text: str, wrong: int) -> None:
    for name in ("linalg", "robot", "plan"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mod.rs").write_text("use super::linalg::Row;" if name == "plan" else "", encoding="utf-8")
    (tmp_path / "robot" / "dh.rs").write_text(text, encoding="utf-8")
    table = "| `house/linalg/` | | words |\n| `house/robot/` | linalg | words |\n| `house/plan/` | robot | words |\n"
    found = against(rust_uses(tmp_path), arrows(table, "house/"))
    assert found == ["robot.dh uses plan: no arrow from robot to plan"] * wrong
