"""Never says a word."""
import json, sys

def say(message):
    print(message if isinstance(message, str) else json.dumps(message), flush=True)

DESCRIPTION = {
    "name": "broken", "version": "1", "summary": "a plugin that breaks the protocol",
    "inputs": [], "outputs": [{"name": "out", "shape": "array"}],
    "parameters": {
        "type": "object", "additionalProperties": False,
        "properties": {"length": {"type": "integer", "default": 3}},
    },
    "deterministic": True, "seeded": False,
}

def made(values, length=3):
    axis = {"name": "n", "unit": "1", "length": 3, "values": [0, 1, 2]}
    variable = {"name": "value", "unit": "1", "dims": ["n"], "kind": "real", "values": values}
    return {"outputs": {"out": {"shape": "array", "axes": [axis], "variables": [variable]}}}

import time
time.sleep(600)
