"""A stage of one's own in Python: what `afmid new stage NAME --python` begins with.

    afmid plugin check -- python3 new_stage.py       # tries it
    afmid trust new_stage.toml                       # shows what would run, and remembers that you agree
    afmid run new_stage.toml                         # runs it on simulated records
"""
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python/afmid_stage"))
import afmid_stage as afmid


def example():
    """Small inputs that `afmid plugin check` runs."""
    time = afmid.Axis("time", "s", np.arange(5) * 1e-6)
    mean = afmid.Variable("mean", "V", ["time"], np.array([9.0, 1.0, 3.0, 1.0, 3.0]))
    return [("two levels", {"samples": 4}, {"average": afmid.Array([time], [mean])})]


@afmid.stage(
    name="new_stage", version="1", summary="Root mean square of the end of an averaged event",
    inputs=[afmid.port("average", "array", tag="average", doc="the averaged event; its first variable is used")],
    outputs=[afmid.port("summary", "document", tag="summary", doc="root mean square of the end")],
    parameters={"samples": afmid.integer(512, "samples at the end", minimum=2)},
    source="the definition of a standard deviation",
    examples=example,
)
def new_stage(inputs, parameters, context):
    signal = inputs["average"].variables[0].values
    if signal.size < parameters["samples"]:
        raise afmid.Refused(f"the event has {signal.size} samples, wanted at least {parameters['samples']}", "lower `samples`")
    end = signal[-parameters["samples"]:]
    return {"summary": {"rms": float(np.std(end)), "samples": int(end.size)}}


if __name__ == "__main__":
    afmid.serve(new_stage)
