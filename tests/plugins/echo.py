"""Gives back what it gets, every shape; says who it is. For tests of the exchange layout."""
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python/afmid_stage"))
import afmid_stage as afmid

SHAPES = ("array", "table", "state_space", "document")


@afmid.stage(
    name="echo",
    version="1",
    summary="Gives back what it gets",
    seeded=True,
    inputs=[afmid.port(shape, shape, optional=True) for shape in SHAPES]
    + [afmid.port("recording", "recording", optional=True)],
    outputs=[afmid.port(shape, shape, optional=True, finite=False) for shape in SHAPES]
    + [afmid.port("about", "document")],
    parameters={
        "scale": afmid.number(1.0, "multiplies nothing", minimum=0, maximum=10),
        "steps": afmid.integer(0, "steps of progress"),
        "mode": afmid.choice(["plain", "loud"], "plain"),
        "table": afmid.text("", "a file", path=True),
    },
)
def echo(inputs, parameters, context):
    for done in range(parameters["steps"]):
        context.progress(done + 1, parameters["steps"])
    if parameters["mode"] == "loud":
        print("this goes to stderr")
        context.warn("it was loud")
    recording = inputs.pop("recording", [])
    about = {"seed": context.seed, "base": context.base, "parameters": parameters}
    about["records"] = [
        [r.file, r.sample_rate_hz, r.channels[0].role, r.read(r.channels[0].role, 1, 2).tolist()] for r in recording
    ]
    if parameters["mode"] == "loud":
        about["pid"] = os.getpid()
    return {**inputs, "about": about}


afmid.serve(echo)
