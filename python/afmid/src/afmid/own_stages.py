"""Stages of one's own that run in the process: what `afmid.run(config, stages=[...])` does with them."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from . import plugin
from .errors import ConfigError


def served(stage: Any) -> tuple[str, list[str], Callable[[str, str], str]]:
    """A stage as the native module takes it: the name that configs have for it (`exec:NAME`), what belongs to the key
    of its results, and the function that answers the requests of the protocol.

    >>> @plugin.stage(name="a", version="1", summary="nothing", outputs=[plugin.port("b", "document")])
    ... def nothing(inputs, parameters, context):
    ...     return {"b": {}}
    >>> name, key, answer = served(nothing)
    >>> name, json.loads(answer("describe", "null"))["result"]["summary"]
    ('a', 'nothing')
    """
    if not (hasattr(stage, "description") and hasattr(stage, "describe") and callable(getattr(stage, "run", None))):
        raise ConfigError(f"a stage is {stage!r}", help="make it with `afmid.stage`")

    def answer(method: str, params: str) -> str:
        request = {"id": 0, "method": method, "params": json.loads(params) or {}}
        try:
            return json.dumps({"result": plugin._answer(stage, request, lambda _: None)}, allow_nan=False)
        except Exception as error:
            # `Refused` of the copy that a plugin has beside it, too
            if type(error).__name__ != "Refused":
                raise
            return json.dumps({"error": {"message": str(error), "help": getattr(error, "help", None)}})

    return str(stage.description["name"]), [_made_of(stage.run)], answer


def _made_of(function: Callable[..., Any]) -> str:
    """The bytes of the file that a function is written in; of one that is in none, its code."""
    try:
        made_of = Path(inspect.getsourcefile(function) or "").read_bytes()
    except (OSError, TypeError):
        code = getattr(function, "__code__", None)
        made_of = repr(code and (code.co_code, code.co_consts, code.co_names)).encode()
    return f"python {getattr(function, '__qualname__', '')} sha256:{hashlib.sha256(made_of).hexdigest()}"
