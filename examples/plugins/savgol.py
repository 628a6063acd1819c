"""A transfer function smoothed by scipy's Savitzky-Golay filter, beside afmid's own: `afmid run examples/plugins/savgol.toml --allow-plugins`.

Real and imaginary parts are smoothed, never magnitudes: noise adds to those. A polynomial over `half_width_bins` on either side flattens resonances that are
hardly wider than that, which the comparison shows.
"""
import sys
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

# where afmid_stage is installed (`pip install ./python/afmid_stage`), this line is not needed
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python/afmid_stage"))
import afmid_stage as afmid


def example():
    f = np.arange(64) * 1e3
    g = 1.0 / (1.0 + 1j * f / 2e4) + 1e-3 * np.cos(7.0 * np.arange(64))
    axis = afmid.Axis("frequency", "Hz", f)
    etfe = afmid.Array([axis], [
        afmid.Variable("transfer", "1", ["frequency"], g),
        afmid.Variable("variance", "1", ["frequency"], np.full(64, 1e-6)),
    ])
    return [("a roll-off with a wiggle", {"half_width_bins": 5}, {"etfe": etfe})]


@afmid.stage(
    name="savgol", version="1", summary="Savitzky-Golay smoothing of a transfer function by scipy",
    inputs=[
        afmid.port("etfe", "array", tag="transfer", doc="complex transfer function and its variance"),
        afmid.port("reference", "array", tag="transfer", doc="another smoothed estimate, to compare with", optional=True),
    ],
    outputs=[
        afmid.port("smoothed", "array", tag="transfer", doc="smoothed transfer function and its variance", finite=False),
        afmid.port("comparison", "document", doc="differences from the reference", optional=True),
    ],
    parameters={
        "half_width_bins": afmid.integer(10, "bins on either side", minimum=1, maximum=1000),
        "degree": afmid.integer(2, "degree of the polynomial", minimum=0, maximum=6),
    },
    source="A. Savitzky, M. J. E. Golay, Anal. Chem. 36 (1964) 1627",
    examples=example,
)
def savgol(inputs, parameters, context):
    etfe = inputs["etfe"]
    transfer, variance = etfe["transfer"], etfe["variance"]
    width, degree = 2 * parameters["half_width_bins"] + 1, parameters["degree"]
    if degree >= width:
        raise afmid.Refused(f"a polynomial of degree {degree} needs more than {width} bins", "widen half_width_bins")
    known = np.flatnonzero(np.isfinite(transfer))
    if known.size < width:
        raise afmid.Refused(f"{known.size} bins are defined, wanted at least {width}", "widen the bandwidth of the estimate")
    band = slice(known[0], known[-1] + 1)
    gaps = band.stop - band.start - known.size
    if gaps:
        context.warn(f"{gaps} undefined bins inside the band are filled in on straight lines before smoothing")
    inside = np.arange(band.start, band.stop)
    filled = np.interp(inside, known, transfer.real[known]) + 1j * np.interp(inside, known, transfer.imag[known])
    smooth = np.full(transfer.shape, np.nan, dtype=complex)
    smooth[band] = savgol_filter(filled.real, width, degree) + 1j * savgol_filter(filled.imag, width, degree)
    # variance of the middle value of the fitted polynomial: the filter's weights squared
    middle = np.zeros(width)
    middle[width // 2] = 1.0
    gain = float(np.sum(savgol_filter(middle, width, degree, mode="constant") ** 2))
    made = afmid.Array(etfe.axes, [
        afmid.Variable("transfer", "1", [etfe.axes[0].name], smooth,
                       "smoothed transfer function"),
        afmid.Variable("variance", "1", [etfe.axes[0].name], np.where(np.isfinite(smooth), gain * variance, np.nan),
                       "expected squared error, without bias"),
    ], etfe.attributes)
    outputs = {"smoothed": made}
    if "reference" in inputs:
        other = inputs["reference"]["transfer"]
        both = np.isfinite(smooth) & np.isfinite(other)
        peak = int(np.nanargmax(np.where(both, np.abs(other), np.nan)))
        difference = np.abs(smooth - other)[both]
        outputs["comparison"] = {
            "bins": int(both.sum()),
            "rms_difference": float(np.sqrt(np.mean(difference**2))),
            "largest_peak_hz": float(etfe.axes[0].values[peak]),
            "largest_peak_over_reference": float(np.abs(smooth[peak]) / np.abs(other[peak])),
        }
    return outputs


if __name__ == "__main__":
    afmid.serve(savgol)
