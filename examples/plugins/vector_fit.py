"""Modes by scikit-rf's vector fitting, beside afmid's own: `afmid run examples/plugins/vector_fit.toml --allow-plugins`.

Vector fitting takes a smoothed transfer function for exact: it gives no errors.
"""
import sys
import warnings
from pathlib import Path

import numpy as np
import skrf

# where afmid_stage is installed (`pip install ./python/afmid_stage`), this line is not needed
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python/afmid_stage"))
import afmid_stage as afmid


def example():
    f = np.linspace(1e3, 2e5, 400)
    s, w, q = 2j * np.pi * f, 2 * np.pi * 5e4, 30.0
    g = w**2 / (s**2 + w / q * s + w**2)
    transfer = afmid.Array([afmid.Axis("frequency", "Hz", f)], [afmid.Variable("transfer", "1", ["frequency"], g)])
    return [("one mode at 50 kHz, Q 30", {"modes": 1, "real_poles": 0}, {"transfer": transfer})]


@afmid.stage(
    name="vector-fit", version="1", summary="Modes of a transfer function by scikit-rf's vector fitting",
    inputs=[
        afmid.port("transfer", "array", tag="transfer", doc="complex transfer function"),
        afmid.port("reference", "table", tag="modes", doc="another modal table, to compare with", optional=True),
    ],
    outputs=[
        afmid.port("modes", "table", doc="frequencies and quality factors"),
        afmid.port("comparison", "table", doc="relative differences from the nearest mode of the reference", optional=True),
    ],
    parameters={
        "modes": afmid.integer(4, "pairs of poles", minimum=1, maximum=40),
        "real_poles": afmid.integer(3, "real poles: detector and electronics", minimum=0, maximum=20),
    },
    source="B. Gustavsen, A. Semlyen, IEEE Trans. Power Delivery 14 (1999) 1052",
    examples=example,
)
def vector_fit(inputs, parameters, context):
    array = inputs["transfer"]
    f, g = array.axes[0].values, array["transfer"]
    use = np.isfinite(g) & (f > 0)
    network = skrf.Network(f=f[use], f_unit="Hz", s=g[use].reshape(-1, 1, 1), z0=50.0)
    fit = skrf.vectorFitting.VectorFitting(network)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fit.vector_fit(n_poles_real=parameters["real_poles"], n_poles_cmplx=parameters["modes"], fit_constant=True)
    for text in dict.fromkeys(str(one.message) for one in caught):
        context.warn(text)
    pairs = sorted((p for p in fit.poles if p.imag > 0), key=abs)
    if not pairs:
        raise afmid.Refused("vector fitting found no pair of poles", "give more `modes`")
    poles = np.array(pairs)
    frequency, quality = np.abs(poles) / (2 * np.pi), np.abs(poles) / (-2 * poles.real)
    made = {"modes": afmid.Table([
        afmid.Column("frequency_hz", "Hz", frequency, "undamped frequency"),
        afmid.Column("quality_factor", "1", quality, "quality factor"),
    ])}
    if "reference" in inputs:
        other = inputs["reference"]
        f0, q0 = np.asarray(other["frequency_hz"]), np.asarray(other["quality_factor"])
        nearest = [int(np.argmin(np.abs(frequency - one))) for one in f0]
        made["comparison"] = afmid.Table([
            afmid.Column("reference_frequency_hz", "Hz", f0, "frequency in the reference"),
            afmid.Column("frequency_difference", "1", frequency[nearest] / f0 - 1, "relative difference"),
            afmid.Column("quality_factor_difference", "1", quality[nearest] / q0 - 1, "relative difference"),
        ])
    return made


if __name__ == "__main__":
    afmid.serve(vector_fit)
