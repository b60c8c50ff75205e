"""Flexures: case 13, chains of many small beams, published limits."""

import itertools
import math

import numpy as np
import pytest
import scipy.integrate
from analytic import lever

import ibsdyn as ibs

E, NU = 1.93e11, 0.29
G = E / (2 * (1 + NU))


def slices(boundaries, height, width):
    """Compliance at the middle of a beam of variable height, slice after slice, 6 x 6, by equilibrium of each slice."""
    total = np.zeros((6, 6))
    for a, b in itertools.pairwise(boundaries):
        x, dx, h = 0.5 * (a + b), b - a, height(0.5 * (a + b))
        area, shear = h * width, 5 / 6 * G * h * width
        long, short = max(h, width), min(h, width)
        J = long * short**3 * (1 / 3 - 0.21 * short / long * (1 - short**4 / 12 / long**4))
        own = np.diag(
            [
                dx / (E * area),
                dx / shear,
                dx / shear,
                dx / (G * J),
                12 * dx / (E * h * width**3),
                12 * dx / (E * width * h**3),
            ]
        )
        carry = lever(np.array([-x, 0, 0]))  # motion of the middle from that of the slice
        total += carry @ own @ carry.T
    return total


def test_case_13(validated):
    size = {"length": 0.05, "width": 0.02, "thickness": 3e-4, "youngs_modulus": 1.93e11}
    leaf = ibs.leaf_spring(**size)
    shear = 0.05 / (5 / 6 * 1.93e11 / 2.6 * 0.02 * 3e-4)  # which the case leaves out
    assert 1 / (1 / leaf["ky"] - shear) == pytest.approx(833.76, rel=1e-6)
    book = {"source": "Soemers, Design Principles for Precision Mechanisms", "against": "closed forms"}
    validated("leaf spring 12EI/L³ (shear adds 1e-4)", expected=833.76, found=leaf["ky"], rtol=2e-4, unit="N/m", **book)
    guide = ibs.parallel_guide(spacing=0.06, **size)
    validated("parallel guide 24EI/L³", expected=1667.52, found=guide["ky"], rtol=2e-4, unit="N/m", **book)
    assert math.sqrt(guide["ky"] / 1.2) / (2 * math.pi) == pytest.approx(5.9329, rel=1e-4)
    pivot = ibs.cross_flexure(**size)["kzz"]
    papers = {"source": "Haringx 1949; Wittrick 1951", "against": "closed forms"}
    validated("cross flexure 2EI/L", expected=0.3474, found=pivot, rtol=1e-6, unit="N·m/rad", **papers)
    assert ibs.cross_flexure_rotation(**size) == pytest.approx(0.3474, rel=1e-6)
    assert ibs.guide_shortening(1e-3, 0.05) == pytest.approx(1.2e-5, rel=1e-9)


def test_leaf_against_a_chain_of_slices():
    leaf = ibs.leaf_spring(0.03, 0.02, 0.5e-3, E, NU)
    compliance = slices(np.linspace(-0.015, 0.015, 2001), lambda x: 0.5e-3, 0.02)
    np.testing.assert_allclose(compliance, np.diag(1 / np.array(leaf.stiffness)), rtol=1e-5, atol=1e-15)


def test_notch_against_a_chain_of_slices(validated):
    r, t, b = 5e-3, 0.4e-3, 8e-3
    hinge = ibs.notch_hinge(r, t, b, E, NU)
    places = r * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 4001))
    compliance = slices(places, lambda x: t + 2 * r - 2 * math.sqrt(r**2 - x**2), b)
    np.testing.assert_allclose(compliance, np.diag(1 / np.array(hinge.stiffness)), rtol=1e-4, atol=1e-13)
    sum_of_slices = 1 / np.diag(compliance)
    validated(
        "notch hinge, six stiffnesses",
        "4000 beam slices in series",
        sum_of_slices,
        hinge.stiffness,
        rtol=1e-4,
        against="calculations by hand",
        unit="N/m, N·m/rad",
    )


def test_thin_notch_tends_to_the_published_limits(validated):
    """Paros and Weisbord for t << r: 2 E b t^2.5 / (9 pi sqrt r), and E b / (pi sqrt(r/t) - 2.57) axially."""
    r, b = 10e-3, 5e-3
    for t, tolerance in ((1e-4, 0.02), (1e-6, 2e-4)):
        hinge = ibs.notch_hinge(r, t, b, E, NU)
        limit = 2 * E * b * t**2.5 / (9 * np.pi * math.sqrt(r))
        what, source = f"notch hinge, t/r = {t / r:g}: limit for thin notches", "Paros and Weisbord 1965"
        validated(what, source, limit, hinge["kzz"], rtol=tolerance, against="closed forms", unit="N·m/rad")
        axial = E * b / (np.pi * math.sqrt(r / t) - 1 - np.pi / 2)
        assert hinge["kx"] == pytest.approx(axial, rel=tolerance)


def test_guide_in_a_model_is_two_leaves():
    """K of two connections at the leaves' middles, carried to the middle between them, is the closed form."""
    leaf = ibs.leaf_spring(0.05, 0.02, 3e-4, E, NU)
    guide = ibs.parallel_guide(0.05, 0.02, 3e-4, 0.06, E, NU)
    frequencies = []
    for parts in ([(0.03, leaf), (-0.03, leaf)], [(0.0, guide)]):
        model = ibs.Model("stage")
        model.fixation("base", position=(0, 0, 0))
        model.rigid_body("stage", mass=1.2, cog=(0.04, 0.01, 0), inertia=(1e-3, 2e-3, 2.2e-3, 0, 0, 0))
        for i, (y, part) in enumerate(parts):
            model.connection(f"c{i}", "base", "stage", position1=(0.025, y, 0), stiffness=part.stiffness)
        frequencies.append(model.linearize().modes().frequencies)
    np.testing.assert_allclose(*frequencies, rtol=1e-9)


@pytest.mark.parametrize("half_angle", [math.pi / 4, 0.5])
def test_cross_in_a_model_is_two_turned_leaves(half_angle):
    leaf = ibs.leaf_spring(0.03, 0.01, 2e-4, E, NU)
    cross = ibs.cross_flexure(0.03, 0.01, 2e-4, E, NU, half_angle=half_angle)
    frequencies = []
    for parts in ([(half_angle, leaf), (-half_angle, leaf)], [(0.0, cross)]):
        model = ibs.Model("pivot")
        model.fixation("base", position=(0, 0, 0))
        model.rigid_body("mirror", mass=0.2, cog=(0, 0, 0.01), inertia=(1e-4, 2e-4, 2.2e-4, 0, 0, 0))
        for i, (angle, part) in enumerate(parts):
            c, s = math.cos(angle), math.sin(angle)
            axes = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
            model.connection(f"c{i}", "base", "mirror", (0, 0, 0), stiffness=part.stiffness, axes=axes)
        frequencies.append(model.linearize().modes().frequencies)
    np.testing.assert_allclose(*frequencies, rtol=1e-9)


@pytest.mark.parametrize("crossing", [0.5, 0.2, 0.0, -0.3])
def test_crossing_elsewhere(crossing):
    """A leaf whose end turns about a point on its line at c L: energy of the cubic through its end conditions."""
    L, b, t = 0.04, 0.01, 2e-4
    EI = E * b * t**3 / 12
    x = np.linspace(0, L, 100_001)
    # clamped at 0; at L it turns by 1 and moves sideways by the lever (1 - c) L
    end, slope = (1 - crossing) * L, 1.0
    curvature = (6 * end / L**2 - 2 * slope / L) + x * (6 * slope / L**2 - 12 * end / L**3)
    energy = scipy.integrate.trapezoid(EI * curvature**2, x) / 2
    assert ibs.cross_flexure_rotation(L, b, t, E, crossing) == pytest.approx(2 * 2 * energy, rel=1e-8)


def test_what_is_no_flexure():
    with pytest.raises(ibs.ModelError, match="thickness must be above 0"):
        ibs.leaf_spring(0.05, 0.02, 0.0, E)
    with pytest.raises(ibs.ModelError, match="poisson_ratio"):
        ibs.leaf_spring(0.05, 0.02, 3e-4, E, 30)
    with pytest.raises(ibs.ModelError, match="degrees"):
        ibs.cross_flexure(0.05, 0.02, 3e-4, E, half_angle=45)
    with pytest.raises(ibs.ModelError, match="overlap"):
        ibs.parallel_guide(0.05, 0.02, 3e-4, 1e-4, E)
    with pytest.warns(ibs.ModelWarning, match="GPa"):
        ibs.leaf_spring(0.05, 0.02, 3e-4, 193)
    with pytest.warns(ibs.ModelWarning, match="no leaf"):
        ibs.leaf_spring(0.01, 0.02, 5e-3, E)
    with pytest.warns(ibs.ModelWarning, match="block"):
        ibs.notch_hinge(1e-3, 2e-3, 5e-3, E)
    leaf = ibs.leaf_spring(0.05, 0.02, 3e-4, E)
    with pytest.raises(ibs.ModelError, match="kxy"):
        leaf["kxy"]
    assert "leaf spring 50 x 20 x 0.3 mm: kx" in str(leaf)
