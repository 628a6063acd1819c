"""SDyPy's least-squares complex frequency method, with its residues (LSFD)."""

import numpy as np

from responses import of_decay, of_hits, of_random
from truth import match, modal

# kind of each case's frequency response, and the band in Hz
GIVEN = {
    "free decay": ("receptance", 10.0, 500.0),
    "SIMO decay": ("receptance", 10.0, 500.0),
    "hammer FRF": ("accelerance", 20.0, 700.0),
    "random input": ("mobility", 5.0, 200.0),
}


def response(case, record, segment):
    """Frequencies and responses, which the fit takes: not part of its time. `segment`: samples, of a random input."""
    if case == "random input":
        return of_random(record, segment)
    return (of_hits if case == "hammer FRF" else of_decay)(record)[:2]


def fit(case, given, order, picked, poles):
    """`picked`: "stable", stable poles near the true frequencies, as its documentation does with frequencies read off
    by eye; "chart", what a user clicks who knows the truth: the poles of the highest order nearest to it.
    """
    from sdypy import EMA

    frequency, h = given
    kind, lower, upper = GIVEN[case]
    model = EMA.Model(h, frequency, lower=lower, upper=upper, pol_order_high=order, frf_form=kind)
    model.get_poles(show_progress=False)
    if picked == "stable":
        model.select_closest_poles(list(modal(poles)[0]))
        model.get_constants()
        size = 2.0 * np.pi * model.nat_freq
        return size * (-model.nat_xi + 1j * np.sqrt(1.0 - model.nat_xi**2))
    last = model.all_poles[-1]
    chosen = match(last, poles)[1]
    model.pole_ind = [[len(model.all_poles) - 1, i] for i in chosen]
    model.get_constants()
    return last[chosen]
