"""Starts a process of its own, says its id on stderr, and hangs with it. For the test that a time limit ends both."""
import json
import subprocess
import sys
import time

print(json.dumps({"afmid_stage": 1, "protocol": {"min": 1, "max": 1}, "name": "orphan", "version": "1"}), flush=True)
for line in sys.stdin:
    request = json.loads(line)
    if request["method"] == "describe":
        result = {
            "name": "orphan", "version": "1", "summary": "hangs with a child", "inputs": [],
            "outputs": [{"name": "out", "shape": "document"}], "deterministic": False, "seeded": False,
            "parameters": {"type": "object", "additionalProperties": False, "properties": {}},
        }
        print(json.dumps({"id": request["id"], "result": result}), flush=True)
    elif request["method"] == "run":
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        print(f"child {child.pid}", file=sys.stderr, flush=True)
        time.sleep(600)
    else:
        break
