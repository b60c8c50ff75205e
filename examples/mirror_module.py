"""A mirror module for laser satellite communication, from its requirement to a hybrid with a real FE part.

The mirror steers a laser beam. It is adjusted about z on a flexure pivot and must then stay still while its platform
vibrates. The model grows as the design does:

    requirement       how far the beam may move under which vibration -> stiffness needed
    1-D concept       platform, flexure, mirror about z
    3-D rigid bodies  flanges and mirror as bodies, every leaf spring and screw pattern as a connection
    hybrid            the flexure as the finite-element part that CalculiX exported, the rest as before

Run `python examples/mirror_module.py [folder]`: it prints the three fidelities side by side and writes two figures
into the folder (by default `output` beside this file). The flexure itself is made by `mirror_flexure.py`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mirror_flexure import EXPORT, MM, Flexure, Material

import fem_import as fi
import ibsdyn as ibs

# --- requirement -----------------------------------------------------------------------------------------------------

ANGULAR_ACCELERATION = 2.0  # rad/s²: peak vibration of the platform about z, well below the first resonance
BEAM_DEFLECTION = 2e-6  # rad: a tenth of the divergence of a 20 µrad beam, so that the link loses no power

# --- parts -----------------------------------------------------------------------------------------------------------

FLEXURE, TITANIUM = Flexure(), Material()
ALUMINIUM = 2700.0  # kg/m³
DISC_DIAMETER, DISC_THICKNESS = 0.080, 0.022  # m: 1:3.6 keeps the face flat when it is polished
PLATE = (0.003, 0.030, 0.035)  # m: mount plate glued to the disc, as wide and deep as the tip flange

SCREW_ZETA = 0.01  # bolted joints: 0.5 to 2 %
TITANIUM_ZETA = 0.002  # monolithic titanium: hardly any damping
# One screw with the ring of material under its head: axial about E A / L of that ring, in shear about half of it.
M4 = (1.0e8, 0.5e8)  # N/m
M3 = (0.8e8, 0.4e8)  # N/m


@dataclass(frozen=True)
class Block:
    """A homogeneous body: mass [kg], centre [m], principal moments of inertia about it [kg m²]."""

    mass: float
    centre: tuple[float, float, float]
    moments: tuple[float, float, float]

    @staticmethod
    def box(density: float, size: Sequence[float], centre: tuple[float, float, float]) -> Block:
        """Return a cuboid of a density [kg/m³] and size along x, y, z [m]."""
        a, b, c = size
        mass = density * a * b * c
        return Block(mass, centre, tuple(mass / 12 * (p * p + q * q) for p, q in ((b, c), (a, c), (a, b))))

    @staticmethod
    def disc(density: float, diameter: float, thickness: float, centre: tuple[float, float, float]) -> Block:
        """Return a disc whose axis is x."""
        mass = density * np.pi / 4 * diameter**2 * thickness
        across = mass * (diameter**2 / 16 + thickness**2 / 12)
        return Block(mass, centre, (mass * diameter**2 / 8, across, across))

    def __add__(self, other: Block) -> Block:
        """Join two blocks whose centres lie on the x axis (Steiner)."""
        mass = self.mass + other.mass
        x = (self.mass * self.centre[0] + other.mass * other.centre[0]) / mass
        steiner = sum(block.mass * (block.centre[0] - x) ** 2 for block in (self, other))
        own = np.add(self.moments, other.moments) + np.array([0.0, steiner, steiner])
        return Block(mass, (x, 0.0, 0.0), tuple(own))

    def about(self, x: float) -> float:
        """Return the moment of inertia about the line parallel to z through (x, 0) [kg m²]."""
        return self.moments[2] + self.mass * (self.centre[0] - x) ** 2


def mirror() -> Block:
    """The disc and its mount plate: 0.307 kg, CoG on the pivot axis within 0.2 mm."""
    face = FLEXURE.height * MM
    plate = Block.box(ALUMINIUM, PLATE, (face + PLATE[0] / 2, 0.0, 0.0))
    disc = Block.disc(ALUMINIUM, DISC_DIAMETER, DISC_THICKNESS, (face + PLATE[0] + DISC_THICKNESS / 2, 0.0, 0.0))
    return plate + disc


def flange(thickness: float, width: float, bottom: float) -> Block:
    """A flange with half of both leaf springs' mass."""
    leaf = FLEXURE.leaf_height * FLEXURE.leaf_thickness * FLEXURE.depth * MM**3 * TITANIUM.density
    plate = Block.box(
        TITANIUM.density,
        (thickness * MM, width * MM, FLEXURE.depth * MM),
        ((bottom + thickness / 2) * MM, 0.0, 0.0),
    )
    return Block(plate.mass + leaf, plate.centre, tuple((1 + leaf / plate.mass) * np.array(plate.moments)))


def leaf_spring(length: float, thickness: float, depth: float) -> tuple[float, ...]:
    """Six stiffnesses of a leaf spring at its middle: along it, through its thickness, along its depth.

    Beam theory, where the stiffness between two clamped ends is diagonal at the middle: E A/L, 12 E I/L³ (with shear
    for the stout edgewise direction), and for the rotations G J/L, E I/L. SI.
    """
    E, G = TITANIUM.youngs_modulus, TITANIUM.youngs_modulus / (2 * (1 + TITANIUM.poisson_ratio))
    area = thickness * depth
    soft, stout = depth * thickness**3 / 12, thickness * depth**3 / 12
    edgewise = 1 / (length**3 / (12 * E * stout) + 1.2 * length / (G * area))
    twist = G * depth * thickness**3 / 3 / length
    return (E * area / length, 12 * E * soft / length**3, edgewise, twist, E * stout / length, E * soft / length)


def screw_pattern(screw: tuple[float, float], y: float, z: float) -> tuple[float, ...]:
    """Six stiffnesses of four screws along x at (+-y, +-z), about their centre. SI."""
    axial, shear = screw
    return (4 * axial, 4 * shear, 4 * shear, 4 * shear * (y * y + z * z), 4 * axial * z * z, 4 * axial * y * y)


@dataclass(frozen=True)
class Leaf:
    """One leaf spring between the flanges: its middle, its axes (columns: along, across, z), its length [m]."""

    middle: tuple[float, float, float]
    axes: np.ndarray
    length: float


def leaf(side: int) -> Leaf:
    """The leaf on the side y > 0 (+1) or y < 0 (-1)."""
    lean = np.arctan(FLEXURE.leaf_slope)
    x = (FLEXURE.base_thickness + FLEXURE.leaf_height / 2) * MM
    y = side * (FLEXURE.pivot_x * MM - x) * FLEXURE.leaf_slope
    along = np.array([np.cos(lean), -side * np.sin(lean), 0.0])
    across = np.cross([0.0, 0.0, 1.0], along)
    return Leaf((x, y, 0.0), np.column_stack([along, across, [0, 0, 1.0]]), FLEXURE.leaf_height * MM / np.cos(lean))


# --- the model grows -------------------------------------------------------------------------------------------------


def required_stiffness() -> float:
    """Return the rotational stiffness that the requirement asks for [N·m/rad]."""
    return ibs.required_stiffness(moving_inertia(), ANGULAR_ACCELERATION, beam_deflection=BEAM_DEFLECTION)


def moving_inertia() -> float:
    """Return what the flexure carries, about the pivot axis [kg m²]."""
    tip = flange(FLEXURE.tip_thickness, FLEXURE.tip_width, FLEXURE.tip_x)
    return mirror().about(FLEXURE.pivot_x * MM) + tip.about(FLEXURE.pivot_x * MM)


def pivot_stiffness() -> float:
    """Return the closed form of the pivot: 2 · 4EI/L · (1 + 3 p/L + 3 (p/L)²), p from pivot to leaf [N·m/rad]."""
    one = leaf(+1)
    bending = leaf_spring(one.length, FLEXURE.leaf_thickness * MM, FLEXURE.depth * MM)[5]
    lean = np.arctan(FLEXURE.leaf_slope)
    reach = (FLEXURE.pivot_x - FLEXURE.tip_x) * MM / np.cos(lean) / one.length
    return 2 * 4 * bending * (1 + 3 * reach + 3 * reach**2)


def concept() -> ibs.Model:
    """1-D about z: one inertia, one stiffness."""
    model = ibs.Model("1-D concept", axis="rz")
    model.fixation("platform")
    model.rigid_body("mirror", inertia=moving_inertia())
    model.connection("flexure", "platform", "mirror", stiffness=pivot_stiffness(), zeta=TITANIUM_ZETA)
    return model


def rigid_bodies() -> ibs.Model:
    """3-D: the same pivot, now made by two leaning leaf springs between rigid flanges."""
    model = ibs.Model("3-D rigid bodies")
    model.fixation("platform", position=(0, 0, 0))
    bodies = {
        "base flange": flange(FLEXURE.base_thickness, FLEXURE.base_width, 0.0),
        "tip flange": flange(FLEXURE.tip_thickness, FLEXURE.tip_width, FLEXURE.tip_x),
        "mirror": mirror(),
    }
    for name, block in bodies.items():
        model.rigid_body(name, mass=block.mass, cog=block.centre, inertia=(*block.moments, 0, 0, 0))
    model.connection(
        "base screws",
        "platform",
        "base flange",
        position1=(0, 0, 0),
        stiffness=screw_pattern(M4, FLEXURE.base_screw_y * MM, FLEXURE.base_screw_z * MM),
        zeta=SCREW_ZETA,
    )
    for name, side in (("leaf +y", +1), ("leaf -y", -1)):
        spring = leaf(side)
        model.connection(
            name,
            "base flange",
            "tip flange",
            position1=spring.middle,
            stiffness=leaf_spring(spring.length, FLEXURE.leaf_thickness * MM, FLEXURE.depth * MM),
            axes=spring.axes,
            zeta=TITANIUM_ZETA,
        )
    model.connection(
        "tip screws",
        "tip flange",
        "mirror",
        position1=(FLEXURE.height * MM, 0, 0),
        stiffness=screw_pattern(M3, FLEXURE.tip_screw_y * MM, FLEXURE.tip_screw_z * MM),
        zeta=SCREW_ZETA,
    )
    return model


def flexure() -> fi.ReducedBody:
    """Read CalculiX's export and reduce it: valid to 4 kHz, twice what is looked at."""
    part = fi.read_calculix(EXPORT / "flexure.inp")
    return fi.reduce(part, interfaces={"base": "BASE", "tip": "TIP"}, max_frequency=8000.0)


def hybrid(reduced: fi.ReducedBody) -> ibs.Model:
    """The flexure as FE part in the place of flanges and leaves; screws, mirror and platform stay as they are."""
    model = rigid_bodies().copy("hybrid with FE flexure")
    model.replace_with_flexible(
        "flexure", reduced, zeta=TITANIUM_ZETA, parts=["base flange", "leaf +y", "leaf -y", "tip flange"]
    )
    return model


# --- what it predicts ------------------------------------------------------------------------------------------------

FREQUENCIES = np.geomspace(20.0, 2000.0, 4000)  # Hz


@dataclass(frozen=True)
class Prediction:
    """What one fidelity predicts."""

    model: ibs.Model
    modes: ibs.Modes
    rotation: ibs.FrequencyResponse  # platform about z -> mirror about z
    cross_talk: ibs.FrequencyResponse | None  # platform along y -> mirror about z; not in 1-D
    beam_deflection: float  # rad under the requirement's vibration


def predict(model: ibs.Model) -> Prediction:
    """Linearise a model and ask it what the requirement is about."""
    system = model.linearize()
    turning = ibs.Sensor("mirror", "rz")
    left_behind = ibs.Sensor("mirror", "rz", quantity="displacement", relative_to="platform")
    quasi_static = system.frf(ibs.BaseMotion("platform", "rz"), left_behind, [1.0])
    sideways = ibs.BaseMotion("platform", "y")
    return Prediction(
        model=model,
        modes=system.modes(),
        rotation=system.frf(ibs.BaseMotion("platform", "rz"), turning, FREQUENCIES),
        cross_talk=system.frf(sideways, turning, FREQUENCIES) if model.axis is None else None,
        # the beam turns twice as far as the mirror
        beam_deflection=2 * ANGULAR_ACCELERATION * float(abs(quasi_static.response[0, 0, 0])),
    )


def main_motion(prediction: Prediction, mode: int) -> str:
    """Return the direction in which the mirror has most of its kinetic energy in a mode."""
    block = mirror()
    inertia = dict(zip(("x", "y", "z", "rx", "ry", "rz"), (block.mass,) * 3 + block.moments, strict=True))
    energy = {
        name.split(".")[1]: inertia[name.split(".")[1]] * prediction.modes.shapes[row, mode] ** 2
        for row, name in enumerate(prediction.modes.coordinates)
        if name.startswith("mirror.")
    }
    return max(energy, key=lambda direction: energy[direction])


def table(predictions: Sequence[Prediction], modes: int = 6) -> str:
    """Return the three fidelities side by side, the requirement in the last column."""
    needed = required_stiffness()
    limit = np.sqrt(needed / moving_inertia()) / (2 * np.pi)
    wide = 25
    lines = ["".join([" " * 24, *(f"{p.model.name:>{wide}}" for p in predictions), f"{'requirement':>14}"])]
    for mode in range(modes):
        cells = []
        for p in predictions:
            cell = "-"
            if mode < len(p.modes):
                f, zeta = p.modes.frequencies[mode], p.modes.damping_ratios[mode]
                cell = f"{f:.1f} Hz {main_motion(p, mode):>3} {100 * zeta:.2f} %"
            cells.append(f"{cell:>{wide}}")
        lines.append(
            "".join([f"{f'mode {mode + 1}, zeta':24}", *cells, f"{f'> {limit:.0f} Hz' if mode == 0 else '':>14}"])
        )
    beams = [f"{f'{1e6 * p.beam_deflection:.2f} µrad':>{wide}}" for p in predictions]
    lines.append("".join([f"{'beam deflection':24}", *beams, f"{f'< {1e6 * BEAM_DEFLECTION:.2f} µrad':>14}"]))
    met = [f"{'yes' if p.beam_deflection < BEAM_DEFLECTION else 'NO':>{wide}}" for p in predictions]
    lines.append("".join([f"{'requirement met':24}", *met]))
    return "\n".join(lines)


def draw(predictions: Sequence[Prediction], folder: Path) -> list[Path]:
    """Write the overlaid FRFs and the hybrid's first mode shapes as PNG files and return their paths."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(
        2, 2, figsize=(11, 6), sharex=True, height_ratios=[2, 1], layout="constrained", squeeze=False
    )
    for number, p in enumerate(predictions):
        p.rotation.plot(axes[:, :1], label=p.model.name)
        if p.cross_talk is not None:
            p.cross_talk.plot(axes[:, 1:], label=p.model.name)
            for panel in axes[:, 1]:
                panel.lines[-1].set_color(f"C{number}")  # a fidelity has one colour in both columns
    axes[0, 1].legend(fontsize="small")
    axes[0, 0].set_title("platform turns about z → mirror turns about z", fontsize="medium")
    axes[0, 1].set_title("platform shakes along y → mirror turns about z", fontsize="medium")
    figure.suptitle("Mirror module: base to mirror, three fidelities")

    shapes = plt.figure(figsize=(11, 9), layout="constrained")
    last = predictions[-1]
    for mode in range(4):
        panel = shapes.add_subplot(2, 2, mode + 1, projection="3d")
        last.modes.plot_shape(mode + 1, axes=panel)
    shapes.suptitle(f"{last.model.name}: first mode shapes (motion enlarged)")

    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / "mirror_module_frf.png", folder / "mirror_module_modes.png"]
    for drawn, path in zip((figure, shapes), paths, strict=True):
        drawn.savefig(path, dpi=120)
        plt.close(drawn)
    return paths


def predictions() -> list[Prediction]:
    """Return what all three fidelities predict."""
    return [predict(model) for model in (concept(), rigid_bodies(), hybrid(flexure()))]


def main(folder: Path) -> None:
    print(
        f"requirement: beam still within {1e6 * BEAM_DEFLECTION:g} µrad under {ANGULAR_ACCELERATION:g} rad/s² about z"
    )
    print(f"needed:      k >= {required_stiffness():.0f} N·m/rad for {moving_inertia():.3g} kg m² about the pivot")
    print(f"flexure:     k  = {pivot_stiffness():.0f} N·m/rad by leaf-spring formula\n")
    results = predictions()
    print(table(results))
    print("\nwhat makes the modes of the hybrid:")
    print("\n".join(str(results[-1].modes).splitlines()[:7]))
    for finding in results[-1].model.check():
        print(f"note: {finding}")
    for path in draw(results, folder):
        print(f"figure: {path}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "output")
