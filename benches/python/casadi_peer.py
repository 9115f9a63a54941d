"""CasADi as a contender: C generated from expressions, compiled for this machine, called without copies."""

import hashlib
import os
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest

from .casadi_expressions import outputs
from .chains import F64, Chain
from .contender import Contender

Function: TypeAlias = Any
COMPILER = ["gcc", "-O3", "-march=native", "-shared", "-fPIC"]


def contender(chain: Chain, quantity: str) -> Contender:
    """One function whose outputs are the value and the derivatives asked for, through `Function.buffer`."""
    n = chain.robot().n
    function = compiled(chain, quantity)
    x, results = np.zeros(n), [np.zeros(function.numel_out(i)) for i in range(function.n_out())]
    call = Call(function, x, results)
    target, evaluate = x.data, call.evaluate  # a memoryview is quicker to fill than its array

    def sweep(postures: Sequence[F64]) -> None:
        for q in postures:
            target[:] = q.data
            evaluate()

    layouts: dict[str, Callable[[F64], F64]] = {
        "fk": lambda flat: flat.reshape(4, 4).T,
        "jacobian": lambda flat: flat.reshape(n, 6).T,
        "jacobian_derivative": lambda flat: flat.reshape(n, n, 6).transpose(2, 1, 0),
    }
    shapes: list[tuple[int, ...]] = [(), (n,), (n, n)]

    def result() -> tuple[F64, ...]:
        if quantity in layouts:
            return (layouts[quantity](results[0]),)
        return tuple(flat.reshape(shape) for flat, shape in zip(results, shapes, strict=False))

    return Contender(sweep, result, call)


class Call:
    """`evaluate` reads one array and writes others, and is valid as long as this object lives."""

    def __init__(self, function: Function, argument: F64, results: list[F64]) -> None:
        self._keep = function, argument, results
        self._buffer, self.evaluate = function.buffer()
        self._buffer.set_arg(0, argument.ravel().data)
        for i, result in enumerate(results):
            self._buffer.set_res(i, result.ravel().data)


def compiled(chain: Chain, quantity: str) -> Function:
    """Build the function or take it from an earlier run: compiling a Hessian takes up to half a minute."""
    ca = pytest.importorskip("casadi")
    q, parts = outputs(chain, quantity)
    symbolic = ca.Function(quantity, [q], [ca.densify(part) for part in ca.cse(parts)])
    generator = ca.CodeGenerator(f"{quantity}.c")
    generator.add(symbolic)
    source: str = generator.dump()
    key = hashlib.sha256("\0".join([source, *COMPILER]).encode()).hexdigest()[:16]
    library = _folder() / f"{chain.name}-{quantity}-{key}.so"
    if not library.exists():
        _compile(source, library)
    return ca.external(quantity, str(library))


def _compile(source: str, library: Path) -> None:
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        file, result = Path(folder, "f.c"), Path(folder, "f.so")
        file.write_text(source)
        try:
            subprocess.run([*COMPILER, str(file), "-o", str(result), "-lm"], check=True)
        except FileNotFoundError:
            pytest.skip("CasADi's C needs gcc")
        os.replace(result, library)


def _folder() -> Path:
    user = getattr(os, "getuid", lambda: 0)()
    folder = Path(tempfile.gettempdir(), f"redundancy-bench-{user}")
    folder.mkdir(mode=0o700, exist_ok=True)
    if folder.is_symlink() or folder.stat().st_uid != user:
        pytest.fail(f"{folder} belongs to somebody else: what lies there is not loaded")
    return folder
