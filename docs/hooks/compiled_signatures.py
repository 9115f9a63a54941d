"""Extension of griffe: shows how a compiled class is called, which its docstring alone does not tell."""

import importlib
import inspect
from typing import Any

import griffe

CORE = "redundancy._core"


class CompiledSignatures(griffe.Extension):
    """Puts the call of a compiled class ahead of its docstring."""

    def on_class(self, *, cls: griffe.Class, **_: Any) -> None:  # noqa: ANN401
        """Add the call to the docstring of one class."""
        if cls.module.path != CORE or cls.docstring is None:
            return
        try:
            signature = inspect.signature(getattr(importlib.import_module(CORE), cls.name))
        except ValueError:  # a class that only others make
            return
        call = f"```python\n{cls.name}{signature}\n```\n\n"
        if signature.parameters and call not in cls.docstring.value:
            cls.docstring.value = call + cls.docstring.value
