"""Closed forms for common flexures: their six stiffnesses, ready for a connection.

All are for small deflections, linear material and rigid clamps, at the elastic centre, where the stiffness is diagonal.
Beam theory with shear: E. P. Popov, Engineering Mechanics of Solids; the layout of guides and pivots: H. Soemers,
Design Principles for Precision Mechanisms (2011); S. T. Smith, Flexures: Elements of Elastic Mechanisms (2000).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import scipy.integrate

from ibsdyn.axes import STIFFNESS_NAMES
from ibsdyn.errors import ModelError, known_keywords, warn_user
from ibsdyn.validation import number

# Share of the area that carries the shear of a rectangle.
SHEAR_SHARE = 5.0 / 6.0
# Beyond this a strip bends as a plate or a block rather than as a beam.
SLENDER = 3.0


@dataclass(frozen=True)
class FlexureStiffness:
    """The stiffness of a flexure at its elastic centre, along its own axes.

    Attributes
    ----------
    name : what it is, with its dimensions.
    axes : what x, y and z are.
    stiffness : kx, ky, kz [N/m], kxx, kyy, kzz [N·m/rad], for ``model.connection(stiffness=..., axes=...)``.
    """

    name: str
    axes: str
    stiffness: tuple[float, float, float, float, float, float]

    def __str__(self) -> str:
        """Return the six stiffnesses in a line, and what the axes are."""
        shown = ", ".join(f"{name} {k:.4g}" for name, k in zip(STIFFNESS_NAMES, self.stiffness, strict=True))
        return f"{self.name}: {shown} ({self.axes})"

    def __getitem__(self, name: str) -> float:
        """Return one stiffness by its name, as ``leaf["kzz"]``; ModelError if there is none of that name."""
        if name not in STIFFNESS_NAMES:
            raise ModelError(f"{self.name}: no stiffness {name!r}; known: {', '.join(STIFFNESS_NAMES)}.")
        return self.stiffness[STIFFNESS_NAMES.index(name)]


@known_keywords
def leaf_spring(
    length: float, width: float, thickness: float, youngs_modulus: float, poisson_ratio: float = 0.3
) -> FlexureStiffness:
    """Return the stiffness of a leaf spring, clamped at both ends, about its middle.

    Parameters
    ----------
    length, width, thickness : between the clamps along x, along z, along y [m].
    youngs_modulus : [Pa].
    poisson_ratio : [-].

    Returns
    -------
    FlexureStiffness; it bends easily along y and about z, and twists easily about x.

    Raises
    ------
    ModelError : a dimension or a modulus that is not above 0, a Poisson ratio outside 0 to 0.5.

    Warns
    -----
    ModelWarning : a leaf so short or thick that beam theory does not hold.

    Notes
    -----
    kx = E A / L, ky, kz = 1 / (L³/(12 E I) + L/(5/6 G A)), kxx = G J / L, kyy, kzz = E I / L. J of a rectangle: W. C.
    Young, R. G. Budynas, Roark's Formulas for Stress and Strain, table of torsion. Clamps that keep the section from
    warping or curving across stiffen a leaf that is wide beside its length, bending by 1/(1 - nu²) at most.
    """
    what = "leaf spring"
    L, b, t, E, G = _checked(length, width, thickness, youngs_modulus, poisson_ratio, what)
    if SLENDER * t > L or b < t:
        warn_user(
            f"{what}: length {L:g} m, width {b:g} m, thickness {t:g} m is no leaf; its length should be {SLENDER:g} "
            "times its thickness at least, and its width more than its thickness."
        )
    area = b * t
    kx = E * area / L
    ky = 1 / (L**3 / (12 * E * b * t**3 / 12) + L / (SHEAR_SHARE * G * area))
    kz = 1 / (L**3 / (12 * E * t * b**3 / 12) + L / (SHEAR_SHARE * G * area))
    kxx = G * torsion_constant(b, t) / L
    return FlexureStiffness(
        f"leaf spring {1e3 * L:g} x {1e3 * b:g} x {1e3 * t:g} mm",
        "x along its length, y across its thickness, z across its width",
        (kx, ky, kz, kxx, E * t * b**3 / 12 / L, E * b * t**3 / 12 / L),
    )


@known_keywords
def parallel_guide(
    length: float, width: float, thickness: float, spacing: float, youngs_modulus: float, poisson_ratio: float = 0.3
) -> FlexureStiffness:
    """Return the stiffness of a straight guide of two parallel leaf springs, about the middle between them.

    Parameters
    ----------
    length, width, thickness : of each leaf, along x, z and y [m].
    spacing : between the middle planes of the leaves, along y [m].
    youngs_modulus : [Pa].
    poisson_ratio : [-].

    Returns
    -------
    FlexureStiffness; it guides along y with 24 E I / L³ and holds all else.

    Raises
    ------
    ModelError : as ``leaf_spring``, or leaves that overlap.

    Notes
    -----
    Two springs in parallel: kzz = 2 E I / L + kx spacing²/4, kxx = 2 G J / L + kz spacing²/4 with kx, kz of both
    leaves together. A stroke y shortens it by ``guide_shortening``.
    """
    s = number(spacing, "parallel guide: spacing", "m", above=0.0)
    leaf = leaf_spring(length, width, thickness, youngs_modulus, poisson_ratio)
    if s <= thickness:
        raise ModelError(f"parallel guide: spacing {s:g} m is not above the thickness {thickness:g} m; leaves overlap.")
    kx, ky, kz, kxx, kyy, kzz = (2 * k for k in leaf.stiffness)
    return FlexureStiffness(
        f"parallel guide of leaves {1e3 * length:g} x {1e3 * width:g} x {1e3 * thickness:g} mm, {1e3 * s:g} mm apart",
        "x along the leaves, y the guided direction, z across the leaves' width",
        (kx, ky, kz, kxx + kz * s**2 / 4, kyy, kzz + kx * s**2 / 4),
    )


@known_keywords
def guide_shortening(stroke: float, length: float) -> float:
    """Return by how much a leaf spring or parallel guide shortens when its end moves sideways [m].

    Parameters
    ----------
    stroke : sideways, of either sign [m].
    length : of the leaves [m].

    Notes
    -----
    3 y² / (5 L), the length of the clamped-guided deflection curve.
    """
    y = number(stroke, "guide_shortening: stroke", "m")
    return 0.6 * y**2 / number(length, "guide_shortening: length", "m", above=0.0)


@known_keywords
def cross_flexure(
    length: float,
    width: float,
    thickness: float,
    youngs_modulus: float,
    poisson_ratio: float = 0.3,
    half_angle: float = math.pi / 4,
) -> FlexureStiffness:
    """Return the stiffness of a cross flexure, leaf springs that cross at their middles, about the crossing.

    Parameters
    ----------
    length, width, thickness : of a leaf [m]; ``width`` is that of all leaves of one direction together.
    youngs_modulus : [Pa].
    poisson_ratio : [-].
    half_angle : between a leaf and the bisector, 45° by default [rad].

    Returns
    -------
    FlexureStiffness; it turns about z with 2 E I / L.

    Raises
    ------
    ModelError : as ``leaf_spring``, or an angle that is not between 0 and pi/2.

    Notes
    -----
    Sum of both leaves, turned by plus and minus the half angle. Leaves lie symmetrically along z (three leaves, or two
    that interleave); two that merely lie side by side couple twisting and bending. Pivots that cross elsewhere:
    ``cross_flexure_rotation``.
    """
    angle = number(half_angle, "cross flexure: half_angle", "rad", above=0.0)
    if angle >= math.pi / 2:
        raise ModelError(f"cross flexure: half_angle must be below pi/2 rad, got {angle:g}; was it given in degrees?")
    leaf = leaf_spring(length, width, thickness, youngs_modulus, poisson_ratio)
    kx, ky, kz, kxx, kyy, kzz = leaf.stiffness
    c, s = math.cos(angle) ** 2, math.sin(angle) ** 2
    return FlexureStiffness(
        f"cross flexure of leaves {1e3 * length:g} x {1e3 * width:g} x {1e3 * thickness:g} mm at "
        f"±{math.degrees(angle):g}°",
        "x the bisector of the leaves, z the axis of rotation",
        (
            2 * (kx * c + ky * s),
            2 * (kx * s + ky * c),
            2 * kz,
            2 * (kxx * c + kyy * s),
            2 * (kxx * s + kyy * c),
            2 * kzz,
        ),
    )


@known_keywords
def cross_flexure_rotation(
    length: float, width: float, thickness: float, youngs_modulus: float, crossing: float = 0.5
) -> float:
    """Return the rotational stiffness of an unloaded cross flexure about the point where its two leaves cross.

    Parameters
    ----------
    length, width, thickness : of a leaf [m].
    youngs_modulus : [Pa].
    crossing : where along the leaves they cross, as a share of their length; 0.5 is softest.

    Returns
    -------
    k = (8 E I / L) (1 - 3 c + 3 c²) [N·m/rad] of two leaves.

    Raises
    ------
    ModelError : a dimension or a modulus that is not above 0, a crossing that is not finite.

    Notes
    -----
    J. A. Haringx, The cross-spring pivot as a constructional element, Applied Scientific Research A1 (1949) 313-332; W.
    H. Wittrick, The theory of symmetrical crossed flexure pivots, Australian Journal of Scientific Research A1 (1948).
    """
    what = "cross flexure"
    L, b, t, E, _ = _checked(length, width, thickness, youngs_modulus, 0.3, what)
    c = number(crossing, f"{what}: crossing", "-")
    return 8 * E * (b * t**3 / 12) / L * (1 - 3 * c + 3 * c**2)


@known_keywords
def notch_hinge(
    radius: float, thickness: float, width: float, youngs_modulus: float, poisson_ratio: float = 0.3
) -> FlexureStiffness:
    """Return the stiffness of a hinge between two circular notches, about its thinnest place.

    Parameters
    ----------
    radius : of both notches [m].
    thickness : least, along y [m].
    width : along z [m].
    youngs_modulus : [Pa].
    poisson_ratio : [-].

    Returns
    -------
    FlexureStiffness of the part between the notches' ends, 2 radius long; it turns about z.

    Raises
    ------
    ModelError : a dimension or a modulus that is not above 0, a Poisson ratio outside 0 to 0.5.

    Warns
    -----
    ModelWarning : notches so shallow that beam theory does not hold.

    Notes
    -----
    J. M. Paros, L. Weisbord, How to design flexure hinges, Machine Design 37 (1965) 151-156: the compliances of the
    slices h(x) = t + 2 r - 2 sqrt(r² - x²) add up; for t << r, kzz = 2 E b t^(5/2) / (9 pi sqrt(r)). The integrals are
    evaluated here. Plane stress: a hinge that is wide beside its length is stiffer, by 1/(1 - nu²) at most.
    """
    what = "notch hinge"
    r = number(radius, f"{what}: radius", "m", above=0.0)
    _, b, t, E, G = _checked(2 * r, width, thickness, youngs_modulus, poisson_ratio, what)
    if t > r:
        warn_user(f"{what}: thickness {t:g} m is above the radius {r:g} m; such a notch bends as a block, not a beam.")

    def compliance(of_slice: Callable[[float, float], float]) -> float:
        def integrand(angle: float) -> float:
            x, height = r * math.sin(angle), t + 2 * r * (1 - math.cos(angle))
            return of_slice(x, height) * r * math.cos(angle)

        # The thin place is sharp in the angle: its width is sqrt(t/r).
        half = scipy.integrate.quad(integrand, 0.0, math.pi / 2, epsabs=0.0, epsrel=1e-10, limit=200)[0]
        return 2 * float(half)

    shear = compliance(lambda x, h: 1 / (SHEAR_SHARE * G * b * h))
    return FlexureStiffness(
        f"notch hinge, radius {1e3 * r:g} mm, thickness {1e3 * t:g} mm, width {1e3 * b:g} mm",
        "x across the hinge from body to body, y across its thickness, z the axis of rotation",
        (
            1 / compliance(lambda x, h: 1 / (E * b * h)),
            1 / (compliance(lambda x, h: 12 * x**2 / (E * b * h**3)) + shear),
            1 / (compliance(lambda x, h: 12 * x**2 / (E * h * b**3)) + shear),
            1 / compliance(lambda x, h: 1 / (G * torsion_constant(b, h))),
            1 / compliance(lambda x, h: 12 / (E * h * b**3)),
            1 / compliance(lambda x, h: 12 / (E * b * h**3)),
        ),
    )


def torsion_constant(width: float, thickness: float) -> float:
    """Return the torsion constant of a rectangle [m⁴], right to 0.5 %.

    Notes
    -----
    a c³ (1/3 - 0.21 c/a (1 - c⁴/(12 a⁴))), a the longer side: Roark's Formulas for Stress and Strain.
    """
    a, c = max(width, thickness), min(width, thickness)
    return float(a * c**3 * (1 / 3 - 0.21 * c / a * (1 - c**4 / (12 * a**4))))


def _checked(
    length: float, width: float, thickness: float, modulus: float, poisson: float, what: str
) -> tuple[float, float, float, float, float]:
    L = number(length, f"{what}: length", "m", above=0.0)
    b = number(width, f"{what}: width", "m", above=0.0)
    t = number(thickness, f"{what}: thickness", "m", above=0.0)
    E = number(modulus, f"{what}: youngs_modulus", "Pa", above=0.0)
    nu = number(poisson, f"{what}: poisson_ratio", "-", minimum=0.0)
    if nu > 0.5:
        raise ModelError(f"{what}: poisson_ratio must be between 0 and 0.5, got {nu:g}.")
    if E < 1e7:
        warn_user(f"{what}: youngs_modulus {E:g} Pa is softer than rubber; was it given in GPa or N/mm²?")
    return L, b, t, E, E / (2 * (1 + nu))
