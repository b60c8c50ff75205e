"""Modes out of frequency responses: against the modes that the responses were made of."""

import sys

import numpy as np
import pytest
from test_comparison import FORCES, MODES, SHAPES, as_frf, response

import ibsdyn as ibs

needs_package = pytest.mark.skipif(
    not __import__("importlib.util", fromlist=["util"]).find_spec("sdypy"), reason='needs the extra "modal" (sdypy-EMA)'
)


def test_without_the_package_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "sdypy", None)
    f = np.arange(1, 1600) * 0.1
    with pytest.raises(ibs.ExtraMissingError, match=r'pip install "ibsdyn\[modal\]"'):
        ibs.estimate_modes(as_frf(f, response(f)))


@needs_package
def test_frequencies_damping_shapes_and_fit():
    f = np.arange(100, 1600) * 0.1
    frf = as_frf(f, response(f))
    modes = ibs.estimate_modes(frf)
    np.testing.assert_allclose(modes.frequencies, [m[0] for m in MODES], rtol=1e-5)
    np.testing.assert_allclose(modes.damping_ratios, [m[1] for m in MODES], rtol=1e-3)
    for r in range(3):
        largest = abs(SHAPES[r]).argmax()
        np.testing.assert_allclose(modes.shapes[:, r], SHAPES[r] / SHAPES[r, largest], atol=1e-3)
        largest = abs(FORCES[r]).argmax()
        np.testing.assert_allclose(modes.participation[:, r], FORCES[r] / FORCES[r, largest], atol=1e-3)
    assert abs(modes.fit.response - frf.response).max() < 1e-3 * abs(frf.response).max()
    assert modes.fit.outputs == frf.outputs
    assert len(str(modes).splitlines()) == 4
    comparison = ibs.compare(frf, frf, modes=(modes, modes))
    np.testing.assert_allclose(np.diag(comparison.mac), 1.0)


@needs_package
def test_noise_moves_them_little_and_modes_can_be_asked_for():
    rng = np.random.default_rng(0)
    f = np.arange(100, 1600) * 0.1
    clean = response(f)
    noise = rng.standard_normal(clean.shape) + 1j * rng.standard_normal(clean.shape)
    modes = ibs.estimate_modes(as_frf(f, clean + 2e-3 * abs(clean).max() * noise), frequencies=[111.0, 47.5])
    np.testing.assert_allclose(modes.frequencies, [48, 110], rtol=1e-3)
    np.testing.assert_allclose(modes.damping_ratios, [0.006, 0.01], rtol=0.1)


@needs_package
def test_what_it_cannot_fit_is_said(capfd):
    f = np.arange(100, 1600) * 0.1
    with pytest.raises(ibs.AnalysisError, match="multiples of one distance"):
        ibs.estimate_modes(as_frf(f**1.1, response(f**1.1)))
    with pytest.raises(ibs.AnalysisError, match="no resonance"):
        ibs.estimate_modes(as_frf(f, np.ones((2, 2, len(f)), dtype=complex)))
    with pytest.raises(ibs.AnalysisError, match="within the response's 10 to"):
        ibs.estimate_modes(as_frf(f, response(f)), frequencies=[300.0])
    with pytest.raises(ibs.AnalysisError, match="order must be a whole number"):
        ibs.estimate_modes(as_frf(f, response(f)), order=1)
    mixed = ibs.FrequencyResponse(f, response(f), ("a", "b"), ("u", "v"), ("m", "m/s²"), ("N", "N"))
    with pytest.raises(ibs.AnalysisError, match="of one quantity"):
        ibs.estimate_modes(mixed)
    ibs.estimate_modes(as_frf(f, response(f)))
    captured = capfd.readouterr()
    assert captured.out == ""
    assert captured.err == ""
