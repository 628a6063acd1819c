"""Answers in words."""
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

say({"afmid_stage": 1, "protocol": {"min": 1, "max": 1}, "name": "broken", "version": "1"})
for line in sys.stdin:
    request = json.loads(line)
    number, method, params = request["id"], request["method"], request.get("params", {})
    if method == "describe":
        say({"id": number, "result": DESCRIPTION})
    elif method == "run":
        if set(params["parameters"]) - {"length"}:
            say({"id": number, "error": {"message": "unknown parameter"}})
            continue
        say("the result is 3")
    elif method == "shutdown":
        break
    else:
        say({"id": number, "error": {"message": "unknown method"}})
