"""Stages of afmid in Python: write a function, get a plugin.

    import afmid_stage as afmid

    @afmid.stage(
        name="halve", version="1", summary="Halves a signal",
        inputs=[afmid.port("average", "array", tag="average")],
        outputs=[afmid.port("half", "array", tag="average")],
        parameters={"by": afmid.number(2.0, "divisor", exclusive_minimum=0)},
    )
    def halve(inputs, parameters, context):
        array = inputs["average"]
        array.variables[0].values = array.variables[0].values / parameters["by"]
        return {"half": array}

    afmid.serve(halve)

The protocol is docs/plugins.md of afmid; this file is all that it takes. It needs numpy and h5py (the latter is
imported when the first file is read or written). stdout belongs to the protocol: `print` goes to stderr while a plugin
is served.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
import traceback
from dataclasses import dataclass, field
from typing import Any, Callable

import numpy as np

__version__ = "0.2.0"
__all__ = [
    "Array", "Axis", "Channel", "Column", "Context", "Record", "Refused", "StateSpace", "Table", "Variable",
    "array_of", "boolean", "choice", "integer", "number", "port", "serve", "stage", "text",
]

#: Versions of the protocol that this file speaks.
PROTOCOL = (1, 1)


class Refused(Exception):
    """Raise it when a stage cannot go on: what was found and wanted, and what to do."""

    def __init__(self, message: str, help: str | None = None):
        super().__init__(message)
        self.help = help


# ---- artifacts -------------------------------------------------------------------------------------------------------


@dataclass
class Axis:
    """An axis with its coordinates (float64)."""

    name: str
    unit: str
    values: np.ndarray
    long_name: str = ""


@dataclass
class Variable:
    """A variable over axes, slowest first: real (float), complex or integer values of that shape."""

    name: str
    unit: str
    dims: list[str]
    values: np.ndarray
    long_name: str = ""


@dataclass
class Array:
    """Variables over shared axes; the first variable is the signal."""

    axes: list[Axis]
    variables: list[Variable]
    attributes: dict[str, Any] = field(default_factory=dict)

    def axis(self, name: str) -> Axis:
        return _named(self.axes, name, "axis")

    def variable(self, name: str) -> Variable:
        return _named(self.variables, name, "variable")

    def __getitem__(self, name: str) -> np.ndarray:
        """The values of a variable or an axis."""
        return _named([*self.variables, *self.axes], name, "variable or axis").values


@dataclass
class Column:
    """A column: float, int or bool values, or a list of texts (unit "")."""

    name: str
    unit: str
    values: Any
    long_name: str = ""


@dataclass
class Table:
    """Columns of equal length."""

    columns: list[Column]
    attributes: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Any:
        return _named(self.columns, name, "column").values


@dataclass
class StateSpace:
    """x(t + Ts) = A x + B u + K e, y = C x + D u + e; covariance is that of the named parameters."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    sample_time_s: float
    K: np.ndarray | None = None
    x0: np.ndarray | None = None
    innovation_variance: float = 0.0
    parameter_names: list[str] = field(default_factory=list)
    parameters: np.ndarray | None = None
    covariance: np.ndarray | None = None
    attributes: dict[str, Any] = field(default_factory=dict)


@dataclass
class Channel:
    """A channel of a record; value = stored * scale_factor + add_offset."""

    role: str
    location: str
    samples: int
    unit: str
    long_name: str
    scale_factor: float
    add_offset: float
    fill_code: float | None


@dataclass
class Record:
    """An acquisition file, and where its channels lie; `reading` says how afmid itself opens it."""

    name: str
    file: str
    size: int
    blake3: str
    sample_rate_hz: float
    started_at: str
    first_sample: int
    reading: Any
    channels: list[Channel]

    def read(self, role: str, start: int = 0, count: int | None = None) -> np.ndarray:
        """Values of a channel of a native (HDF5) record, in its unit."""
        import h5py

        channel = next((one for one in self.channels if one.role == role), None)
        if channel is None:
            raise Refused(f"record {self.name} has no channel `{role}`", "wire records with that channel")
        stop = channel.samples if count is None else min(start + count, channel.samples)
        with h5py.File(self.file, "r") as file:
            raw = file[channel.location][self.first_sample + start : self.first_sample + stop]
        return raw * channel.scale_factor + channel.add_offset


def _named(items: list, name: str, what: str):
    for item in items:
        if item.name == name:
            return item
    have = ", ".join(item.name for item in items)
    raise Refused(f"there is no {what} `{name}`; there is: {have}", "check what is wired to the input")


# ---- declarations ----------------------------------------------------------------------------------------------------


def port(name: str, shape: str, tag: str = "", doc: str = "", optional: bool = False, finite: bool = True) -> dict:
    """A port; shape is "array", "table", "state_space", "document" or (inputs only) "recording"."""
    declared = {"name": name, "shape": shape, "tag": tag, "doc": doc, "optional": optional}
    return declared if finite else {**declared, "finite": False}


_REQUIRED = object()


def _parameter(kind: str, default: Any, doc: str, limits: dict[str, Any]) -> dict:
    words = {
        "exclusive_minimum": "exclusiveMinimum",
        "exclusive_maximum": "exclusiveMaximum",
        "multiple_of": "multipleOf",
    }
    schema = {"type": kind, "description": doc} if doc else {"type": kind}
    schema.update({words.get(name, name): value for name, value in limits.items()})
    return schema if default is _REQUIRED else {**schema, "default": default}


def number(default: Any = _REQUIRED, doc: str = "", **limits: float) -> dict:
    """A real parameter; limits: minimum, maximum, exclusive_minimum, exclusive_maximum."""
    return _parameter("number", default, doc, limits)


def integer(default: Any = _REQUIRED, doc: str = "", **limits: int) -> dict:
    """A whole parameter; limits as for `number`, and multiple_of."""
    return _parameter("integer", default, doc, limits)


def boolean(default: Any = _REQUIRED, doc: str = "") -> dict:
    """A yes-or-no parameter."""
    return _parameter("boolean", default, doc, {})


def text(default: Any = _REQUIRED, doc: str = "", path: bool = False) -> dict:
    """A text parameter; `path`: it names a file, relative to the config, whose bytes go into the cache key."""
    return _parameter("string", default, doc, {"format": "path"} if path else {})


def choice(choices: list[str], default: Any = _REQUIRED, doc: str = "") -> dict:
    """One of several texts."""
    return _parameter("string", default, doc, {"enum": list(choices)})


def array_of(item: dict, default: Any = _REQUIRED, doc: str = "", **limits: int) -> dict:
    """A list of parameters; limits: minItems, maxItems."""
    return _parameter("array", default, doc, {"items": item, **limits})


@dataclass
class Context:
    """What a run may ask: its seed (None if not seeded), the config's folder; where warnings and progress go."""

    seed: int | None
    base: str
    _progress: Callable[[int, int], None]
    warnings: list[str] = field(default_factory=list)

    def warn(self, message: str) -> None:
        """Keeps a warning with the result: what was found, with numbers, and what to do."""
        self.warnings.append(message)

    def progress(self, done: int, total: int) -> None:
        """Says how far the run is."""
        self._progress(done, total)


@dataclass
class Stage:
    """A stage: what `describe` answers, and the function that runs."""

    description: dict
    run: Callable[[dict, dict, Context], dict]
    example: Callable[[], list] | None = None

    def describe(self) -> dict:
        """The answer to `describe`."""
        if self.example is None:
            return self.description
        examples = []
        for title, parameters, inputs in self.example():
            sent = {name: _give(value, _Inline()) for name, value in inputs.items()}
            examples.append({"title": title, "parameters": parameters, "inputs": sent})
        return {**self.description, "examples": examples}


def stage(
    *,
    name: str,
    version: str,
    summary: str,
    outputs: list[dict],
    inputs: list[dict] = (),
    parameters: dict[str, dict] | None = None,
    source: str = "",
    deterministic: bool = True,
    seeded: bool = False,
    examples: Callable[[], list] | None = None,
) -> Callable[[Callable], Stage]:
    """Makes a stage of a function `(inputs, parameters, context) -> outputs`, both by port name.

    `examples`: a function that returns a list of (title, parameters, inputs), small ones: `afmid plugin check` runs
    them.
    """
    parameters = parameters or {}
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "type": "object",
        "properties": parameters,
        "required": [key for key, value in parameters.items() if "default" not in value],
        "additionalProperties": False,
    }
    description = {
        "name": name, "version": version, "summary": summary, "source": source, "inputs": list(inputs),
        "outputs": list(outputs), "parameters": schema, "deterministic": deterministic, "seeded": seeded,
    }
    return lambda run: Stage(description, run, examples)


# ---- the exchange layout: numbers in an HDF5 file, words in the line -------------------------------------------------


class _Inline:
    """Numbers that stand in the line."""

    def put(self, name: str, values: np.ndarray) -> Any:
        return np.asarray(values, dtype=float).ravel().tolist()


class _Writer:
    """Numbers that go into a file, made when the first ones come. h5py's low-level interface: half the time of the
    other.
    """

    def __init__(self, path: str):
        self.path, self.file, self.count = path, None, 0

    def put(self, name: str, values: np.ndarray) -> str:
        from h5py import h5d, h5f, h5s, h5t

        if self.file is None:
            self.file = h5f.create(os.fsencode(self.path))
        self.count += 1
        place = f"/d{self.count}_{''.join(c if c.isalnum() and c.isascii() else '_' for c in name)}"
        values = np.asarray(values, order="C")
        space = h5s.create_simple(values.shape) if values.ndim else h5s.create(h5s.SCALAR)
        dataset = h5d.create(self.file, place.encode(), h5t.py_create(values.dtype, logical=True), space)
        if values.size:
            dataset.write(h5s.ALL, h5s.ALL, values)
        return place

    def close(self) -> None:
        if self.file is not None:
            self.file.close()


class _Reader:
    """Numbers of the input files, each opened once."""

    def __init__(self) -> None:
        self.files: dict[str, Any] = {}

    def get(self, file: str | None, numbers: Any) -> np.ndarray:
        if isinstance(numbers, list):
            return np.asarray(numbers, dtype=float)
        from h5py import h5d, h5f, h5s

        if file not in self.files:
            self.files[file] = h5f.open(os.fsencode(file), h5f.ACC_RDONLY)
        dataset = h5d.open(self.files[file], numbers.encode())
        values = np.empty(dataset.shape, dataset.dtype)
        if values.size:
            dataset.read(h5s.ALL, h5s.ALL, values)
        return values

    def close(self) -> None:
        for file in self.files.values():
            file.close()


def _take(sent: dict, reader: _Reader) -> Any:
    shape = sent["shape"]
    get = lambda numbers: reader.get(sent.get("file"), numbers)  # noqa: E731
    if shape == "document":
        return sent["value"]
    if shape == "array":
        axes = [Axis(a["name"], a["unit"], get(a["values"]), a.get("long_name", "")) for a in sent["axes"]]
        lengths = {axis["name"]: axis["length"] for axis in sent["axes"]}
        variables = []
        for one in sent["variables"]:
            if one["kind"] == "complex":
                re = get(one["re"])
                # re + 1j * im would lose the sign of a zero
                values = np.empty(re.shape, dtype=complex)
                values.real, values.imag = re, get(one["im"])
            else:
                values = get(one["values"])
            values = values.reshape([lengths[dim] for dim in one["dims"]])
            variables.append(Variable(one["name"], one["unit"], one["dims"], values, one.get("long_name", "")))
        return Array(axes, variables, sent.get("attributes", {}))
    if shape == "table":
        columns = []
        for one in sent["columns"]:
            values = one["values"] if one["kind"] == "text" else get(one["values"])
            values = values.astype(bool) if one["kind"] == "flag" else values
            columns.append(Column(one["name"], one["unit"], values, one.get("long_name", "")))
        return Table(columns, sent.get("attributes", {}))
    if shape == "state_space":
        m = {name: get(numbers) for name, numbers in sent["matrices"].items()}
        return StateSpace(
            m["A"], m["B"], m["C"], m["D"], sent["sample_time_s"], m.get("K"), m["x0"].ravel() if "x0" in m else None,
            sent["innovation_variance"], sent["parameter_names"], m["parameters"].ravel(), m.get("covariance"),
            sent.get("attributes", {}),
        )
    if shape == "recording":
        return [Record(**{**r, "channels": [Channel(**c) for c in r["channels"]]}) for r in sent["records"]]
    raise Refused(f"an input has the shape `{shape}`, which this plugin does not know", "update afmid_stage.py")


def _give(made: Any, to: _Inline | _Writer) -> dict:
    if isinstance(made, Array):
        axes = []
        for one in made.axes:
            values = np.asarray(one.values, dtype=float)
            axes.append({"name": one.name, "unit": one.unit, "long_name": one.long_name, "length": int(values.size),
                         "values": to.put(one.name, values)})
        variables = []
        for one in made.variables:
            values = np.asarray(one.values)
            words = {"name": one.name, "unit": one.unit, "long_name": one.long_name, "dims": list(one.dims)}
            if np.iscomplexobj(values):
                parts = {"re": to.put(f"{one.name}_re", values.real), "im": to.put(f"{one.name}_im", values.imag)}
                variables.append({**words, "kind": "complex", **parts})
            else:
                kind = "integer" if np.issubdtype(values.dtype, np.integer) else "real"
                variables.append({**words, "kind": kind, "values": to.put(one.name, values)})
        return {"shape": "array", "axes": axes, "variables": variables, "attributes": _plain(made.attributes)}
    if isinstance(made, Table):
        columns, rows = [], 0
        for one in made.columns:
            words, rows = {"name": one.name, "unit": one.unit, "long_name": one.long_name}, len(one.values)
            if rows and all(isinstance(value, str) for value in one.values):
                columns.append({**words, "kind": "text", "values": [str(value) for value in one.values]})
                continue
            values = np.asarray(one.values)
            kinds = {"b": "flag", "i": "integer", "u": "integer"}
            kind = kinds.get(values.dtype.kind, "real")
            stored = values.astype(np.uint8) if kind == "flag" else values
            columns.append({**words, "kind": kind, "values": to.put(one.name, stored)})
        return {"shape": "table", "rows": rows, "columns": columns, "attributes": _plain(made.attributes)}
    if isinstance(made, StateSpace):
        parts = {"A": made.A, "B": made.B, "C": made.C, "D": made.D, "K": made.K, "x0": made.x0,
                 "parameters": made.parameters, "covariance": made.covariance}
        a, b, c = np.atleast_2d(made.A), np.atleast_2d(made.B), np.atleast_2d(made.C)
        matrices = {
            name: to.put(name, np.asarray(value, dtype=float)) for name, value in parts.items() if value is not None
        }
        return {
            "shape": "state_space",
            "states": a.shape[0],
            "inputs": b.shape[1],
            "outputs": c.shape[0],
            "sample_time_s": float(made.sample_time_s),
            "innovation_variance": float(made.innovation_variance),
            "parameter_names": list(made.parameter_names),
            "matrices": matrices,
            "attributes": _plain(made.attributes),
        }
    if isinstance(made, (dict, list)):
        return {"shape": "document", "value": _plain(made)}
    raise TypeError(f"an output is a {type(made).__name__}, wanted an Array, a Table, a StateSpace or a dict")


def _plain(value: Any) -> Any:
    """Values that JSON has; what is not finite is unknown: null."""
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


# ---- the conversation ------------------------------------------------------------------------------------------------


def serve(served: Stage) -> None:
    """Speaks the protocol on stdin and stdout until `shutdown` or the end of the input."""
    # the protocol keeps the real stdout; whatever else prints goes to stderr
    out = os.fdopen(os.dup(1), "w", encoding="utf-8", newline="\n")
    os.dup2(2, 1)
    threading.Thread(target=_end_with_parent, args=(os.getppid(),), daemon=True).start()

    def say(message: dict) -> None:
        out.write(json.dumps(message, allow_nan=False) + "\n")
        out.flush()

    about = served.description
    say(
        {
            "afmid_stage": 1,
            "protocol": {"min": PROTOCOL[0], "max": PROTOCOL[1]},
            "name": about["name"],
            "version": about["version"],
        }
    )
    for line in sys.stdin:
        request = json.loads(line)
        if request["method"] == "shutdown":
            break
        try:
            say({"id": request["id"], "result": _answer(served, request, say)})
        except Refused as refused:
            say({"id": request["id"], "error": {"message": str(refused), "help": refused.help}})
        except Exception as error:  # a bug in the stage fails this item, not the next one
            traceback.print_exc()
            last = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{os.path.basename(last.filename)}, line {last.lineno}"
            say({"id": request["id"], "error": {"message": f"{type(error).__name__}: {error} ({where})"}})
        sys.stderr.flush()


def _end_with_parent(parent: int) -> None:
    """A killed afmid cannot end what it started: a plugin in the middle of its work notices by itself."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


def _answer(served: Stage, request: dict, say: Callable[[dict], None]) -> dict:
    method, params = request["method"], request.get("params", {})
    if method == "describe":
        return served.describe()
    if method != "run":
        raise Refused(f"there is no method `{method}`", "this plugin knows describe, run and shutdown")
    known = served.description["parameters"]["properties"]
    unknown = [name for name in params["parameters"] if name not in known]
    if unknown:
        raise Refused(f"there is no parameter `{unknown[0]}`", f"there is: {', '.join(known)}")
    for wanted in served.description["inputs"]:
        if not wanted["optional"] and wanted["name"] not in params["inputs"]:
            raise Refused(f"nothing is wired to the input `{wanted['name']}`", "wire it")
    progress = lambda done, total: say({"id": request["id"], "progress": {"done": done, "total": total}})  # noqa: E731
    context = Context(params.get("seed"), params["base"], progress)
    reader, writer = _Reader(), _Writer(params["output"])
    try:
        inputs = {name: _take(sent, reader) for name, sent in params["inputs"].items()}
        made = served.run(inputs, params["parameters"], context)
        outputs = {name: _give(value, writer) for name, value in made.items() if value is not None}
    finally:
        reader.close()
        writer.close()
    return {"outputs": outputs, "warnings": context.warnings}
