"""Docstrings of the public functions: the sections of numpydoc, every parameter with its unit, an example."""

import inspect
import re
from pathlib import Path

import afmid
import pytest

# those of a plugin have a page of their own (docs/plugins.md)
FUNCTIONS = [
    name
    for name in afmid.__all__
    if inspect.isfunction(getattr(afmid, name)) and getattr(afmid, name).__module__ != "afmid.plugin"
]
SECTIONS = ["Parameters", "Returns", "Raises", "Examples"]
# numbers without a unit, and those whose unit is another argument's: what their description has to say
PLAIN_NUMBERS = "robability|hare of|quality factor|relative change|tandard errors|rior variance|ate of|spectra|_hz"
UNIT_IN_NAME = r"_(hz|s|m|bins|samples|per_s)$"


def sections(function):
    """The docstring's sections by their headings; what comes before the first under "" ."""
    parts = re.split(r"^(\w+)\n-+\n", inspect.getdoc(function), flags=re.MULTILINE)
    return dict(zip(["", *parts[1::2]], parts[0::2], strict=True))


def described(text):
    """The entries of a section by name: type, description."""
    entries = {}
    for entry in re.split(r"\n(?=\S)", text.strip()):
        head, _, body = entry.partition("\n")
        names, _, kind = head.partition(" : ")
        for name in names.split(", "):
            entries[name] = (kind, " ".join(body.split()))
    return entries


@pytest.mark.parametrize("name", FUNCTIONS)
def test_sections_parameters_and_units_are_there(name):
    function = getattr(afmid, name)
    found = sections(function)
    assert [section for section in found if section != "Notes"] == ["", *SECTIONS]
    assert found[""].splitlines()[0], "no first line"
    parameters = inspect.signature(function).parameters
    described_here = described(found["Parameters"])
    assert list(described_here) == [one for one in described_here if one in parameters], "no such parameter"
    assert set(described_here) == set(parameters), "a parameter is not described"
    for one, (kind, text) in described_here.items():
        assert text, f"`{one}` has no description"
        if "float" in str(parameters[one].annotation) and not re.search(UNIT_IN_NAME, one):
            assert re.search(PLAIN_NUMBERS, text), f"`{one}` is a number without a unit: {text}"
        assert kind or text.startswith("As for"), f"`{one}` has no type"
    assert all(text for _, text in described(found["Raises"]).values())


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_example_is_run(name):
    function = getattr(afmid, name)
    assert f"afmid.{name}(" in sections(function)["Examples"]
    module = function.__module__.removeprefix("afmid.")
    # those of a result of the program are run by `make test`
    listed = (Path(__file__).with_name("wheel.sh")).read_text(encoding="utf-8")
    assert module in ("response", "result") or re.search(rf"\b{module}\b", listed), f"add {module} to wheel.sh"
