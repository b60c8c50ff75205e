"""The adjustment flexure of the mirror module: from drawing to CalculiX export.

The part is a monolithic, wire-cut flexure pivot of Ti-6Al-4V. A base flange is bolted to the platform by
four M4 screws; two leaf springs lean towards each other and carry a tip flange, to which the mirror's mount
plate is screwed. The planes of the leaves meet in a line parallel to z (a trapezoid, half a butterfly pivot).
About this line the tip turns easily; in all other directions the leaves are pulled, pushed or bent edgewise,
and are stiff. The line passes through the CoG of the mirror with its mount plate, so that a shaking platform
pushes the mirror but hardly turns it.

Global frame of the module, in metres: the origin is the centre of the platform's mounting face, x points from
the platform to the mirror (the mirror's normal), z along the wire of the erosion machine, which is also the
axis of rotation. The part is symmetric about the planes y = 0 and z = 0. With the sizes below:

    base interface  (0,      0, 0)  mean of the nodes in the set BASE, on the mounting face
    tip interface   (0.043,  0, 0)  mean of the nodes in the set TIP, on the face that carries the mount plate
    pivot axis      (0.0565, 0, z)  where the planes of the leaves meet

Running the script meshes the part anew (gmsh), has CalculiX write its stiffness and mass (free-free, 14
digits) and replaces the kept export in `examples/mirror_flexure/`. The other examples only read that export:
they need neither gmsh nor CalculiX.

    pip install ".[mesh]"
    apt-get install calculix-ccx
    python examples/mirror_flexure.py
"""

from __future__ import annotations

import gzip
import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_import.display import skin_of_solids

EXPORT = Path(__file__).with_suffix("")
JOB = "flexure"
MM = 1e-3  # the drawing is in millimetres, the export in metres


@dataclass(frozen=True)
class Flexure:
    """Sizes of the part [mm] and its mesh."""

    depth: float = 35.0  # along z; wide leaves make the other five directions stiff
    base_width: float = 52.0  # along y; 20 to the screws + 6 edge distance (1.5 screw diameters)
    base_thickness: float = 6.0  # 1.5 screw diameters: stiff against the leaves, short enough for M4 x 12
    base_screw_y: float = 20.0  # the 7 mm screw head clears the leaf's root, the key clears the tip flange
    base_screw_z: float = 11.5  # as far apart as the edge distance of 6 allows
    base_hole: float = 4.5  # ISO 273 medium clearance hole for M4
    base_contact: float = 8.0  # ISO 7092 washer for M4: the ring that is surely pressed to the platform

    leaf_thickness: float = 1.0  # sets the rotational stiffness (cubed); thinner is hard to wire-cut straight
    leaf_height: float = 32.0  # along x between the flanges; with the thickness they give about 265 Hz
    leaf_foot_y: float = 14.0  # inside the screws, outside enough for the leaves to lean (15 degrees)
    pivot_x: float = 56.5  # CoG of the mirror: tip face 43 + plate 3 + half a disc 11, and the plate's share
    fillet: float = 1.5  # leaf roots: wire radius 0.15 would do; 1.5 keeps the notch factor near 1

    tip_width: float = 30.0  # along y; narrower than the distance between the base screw heads (33)
    tip_thickness: float = 5.0  # 1.7 screw diameters of M3 thread
    tip_screw_y: float = 10.5  # outside the leaf ends, edge distance 4.5 (1.5 screw diameters)
    tip_screw_z: float = 13.0  # as far apart as the edge distance of 4.5 allows
    tip_hole: float = 2.5  # core hole of an M3 thread: the mount plate is screwed on from the mirror's side
    tip_contact: float = 6.0  # ISO 7092 washer for M3: the ring that is surely pressed to the mount plate

    rows_along: int = 8  # elements along a leaf: with 6 the first frequency is 0.7 % higher
    rows_across: int = 3  # elements along half the depth: 5.8 long, as slender as quality allows
    rows_through: int = 1  # quadratic elements through a leaf's thickness: strain is linear there
    rows_fillet: int = 1  # element edges around a fillet: it only has to stiffen the root by the right amount
    sides_hole: int = 6  # edges around a hole: twice as many move the first frequency by less than 0.1 %
    grading: float = 0.5  # of the elements along a leaf: short at the roots, where the moment is largest
    size_flange: float = 9.0  # longest element edge in the flanges: they hardly deform

    @property
    def tip_x(self) -> float:
        """Height of the tip flange's lower side [mm]."""
        return self.base_thickness + self.leaf_height

    @property
    def height(self) -> float:
        """Height of the face that carries the mirror mount [mm]."""
        return self.tip_x + self.tip_thickness

    @property
    def fillet_end(self) -> float:
        """Distance from a flange, along the leaf, at which both fillets of a root have run out [mm]."""
        sharper = (math.pi / 2 - math.atan(self.leaf_slope)) / 2
        return self.fillet / math.tan(sharper) + self.leaf_thickness / 2

    @property
    def leaf_slope(self) -> float:
        """Lean of a leaf, -dy/dx."""
        return self.leaf_foot_y / (self.pivot_x - self.base_thickness)


@dataclass(frozen=True)
class Material:
    """Ti-6Al-4V, annealed: strong for its stiffness, as leaf springs want it."""

    name: str = "TI6AL4V"
    youngs_modulus: float = 113.8e9  # N/m2
    poisson_ratio: float = 0.342
    density: float = 4430.0  # kg/m3


@dataclass(frozen=True)
class Mesh:
    """Ten-node tetrahedra in CalculiX's node order; rows of `elements` and the sets index `nodes`."""

    nodes: NDArray[np.float64]  # (n, 3) [m]
    elements: NDArray[np.int64]  # (m, 10)
    sets: dict[str, NDArray[np.int64]]


# CalculiX numbers the mid-side nodes 12 23 31 14 24 34, gmsh 12 23 31 14 34 24.
CALCULIX_FROM_GMSH = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
# A mirrored tetrahedron is inside out until two corners, and the mid-side nodes with them, change places.
REFLECTED = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
MIN_QUALITY = 0.1  # signed inverse condition number (SICN): flatter elements make poor stiffness


# --- profile ---


Corner = tuple[float, float, float]  # x, y, radius of the fillet [mm]; radius 0 is a sharp corner


def half_profile(part: Flexure) -> tuple[list[Corner], list[Corner], list[Corner]]:
    """Corners of the half y >= 0 of the profile: base flange, straight part of the leaf, tip flange.

    The fillets belong to the flanges, so that the leaf between them is a plain block, to be meshed in rows.
    """
    along = np.array([1.0, -part.leaf_slope]) / math.hypot(1.0, part.leaf_slope)
    across = np.array([-along[1], along[0]])

    def root(x: float, side: int) -> Corner:
        # Where the leaf's outer (+1) or inner (-1) side would meet the flange without the fillet.
        half_width = part.leaf_thickness / 2 / along[0]
        return x, part.leaf_slope * (part.pivot_x - x) + side * half_width, part.fillet

    def end(x: float, away: int, side: int) -> Corner:
        # Where the straight part ends: just past the longer fillet's tangent point.
        centre = np.array([x, part.leaf_slope * (part.pivot_x - x)])
        point = centre + away * part.fillet_end * along + side * part.leaf_thickness / 2 * across
        return float(point[0]), float(point[1]), 0.0

    foot, top = part.base_thickness, part.tip_x
    base: list[Corner] = [
        (0.0, 0.0, 0.0),
        (0.0, part.base_width / 2, 0.0),
        (foot, part.base_width / 2, 0.0),
        root(foot, +1),
        end(foot, +1, +1),
        end(foot, +1, -1),
        root(foot, -1),
        (foot, 0.0, 0.0),
    ]
    leaf = [end(foot, +1, -1), end(foot, +1, +1), end(top, -1, +1), end(top, -1, -1)]
    tip: list[Corner] = [
        (part.height, 0.0, 0.0),
        (top, 0.0, 0.0),
        root(top, -1),
        end(top, -1, -1),
        end(top, -1, +1),
        root(top, +1),
        (top, part.tip_width / 2, 0.0),
        (part.height, part.tip_width / 2, 0.0),
    ]
    return base, leaf, tip


def chord_factor(turn: float, chords: int) -> float:
    """Ratio of radii at which chords fill a corner with as much material as the arc of the drawing does.

    The mesh replaces the arc, which turns by the angle `turn`, by straight chords. They lie on its hollow
    side: at the same radius they would thicken the leaf roots and raise the first frequency by 6 per cent.
    """
    corner = math.tan(turn / 2)
    return math.sqrt((corner - turn / 2) / (corner - chords / 2 * math.sin(turn / chords)))


def rounded_face(occ: Any, corners: list[Corner], chords: int) -> int:
    """Plane face inside a polygon whose corners carry fillets; returns its gmsh tag."""
    ends: list[tuple[int, int]] = []  # where the outline arrives at and leaves each corner
    arcs: dict[int, int] = {}
    for i, (x, y, radius) in enumerate(corners):
        if radius == 0.0:
            point = occ.addPoint(x, y, 0.0)
            ends.append((point, point))
            continue
        corner = np.array([x, y])
        before = np.array(corners[i - 1][:2]) - corner
        after = np.array(corners[(i + 1) % len(corners)][:2]) - corner
        before, after = before / np.linalg.norm(before), after / np.linalg.norm(after)
        half_angle = math.acos(before @ after) / 2
        radius *= chord_factor(math.pi - 2 * half_angle, chords)
        bisector = (before + after) / np.linalg.norm(before + after)
        tangent = radius / math.tan(half_angle)
        first, last, centre = (
            occ.addPoint(*(corner + step), 0.0)
            for step in (tangent * before, tangent * after, radius / math.sin(half_angle) * bisector)
        )
        arcs[i] = occ.addCircleArc(first, centre, last)
        ends.append((first, last))
    outline: list[int] = []
    for i, (arrives, _) in enumerate(ends):
        outline.append(occ.addLine(ends[i - 1][1], arrives))
        if i in arcs:
            outline.append(arcs[i])
    return int(occ.addPlaneSurface([occ.addCurveLoop(outline)]))


# --- solid ---


Entity = tuple[int, int]  # gmsh's dimension and tag


@dataclass(frozen=True)
class Solid:
    """gmsh tags of what the mesh needs to know about the quarter of the part."""

    leaf: int  # volume
    contacts: dict[str, int]  # faces of the node sets


def quarter_solid(occ: Any, part: Flexure) -> Solid:
    """Quarter y >= 0, z >= 0 of the part [mm]."""
    faces = [(2, rounded_face(occ, corners, part.rows_fillet)) for corners in half_profile(part)]
    base, leaf, tip = (
        next(entity for entity in occ.extrude([face], 0.0, 0.0, part.depth / 2) if entity[0] == 3) for face in faces
    )

    def disc(x: float, y: float, z: float, diameter: float) -> Entity:
        # A polygon of the circle's area: with straight element edges a true circle becomes a ragged hole.
        turn = 2 * math.pi / part.sides_hole
        radius = diameter / 2 * math.sqrt(turn / math.sin(turn))
        points = [
            occ.addPoint(x, y + radius * math.cos(i * turn), z + radius * math.sin(i * turn))
            for i in range(part.sides_hole)
        ]
        lines = [occ.addLine(points[i - 1], points[i]) for i in range(part.sides_hole)]
        return 2, int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))

    def drill(solid: Entity, x: float, y: float, z: float, length: float, diameter: float) -> Entity:
        swept = occ.extrude([disc(x, y, z, diameter)], length, 0.0, 0.0)
        hole = [entity for entity in swept if entity[0] == 3]
        ((dim, tag),), _ = occ.cut([solid], hole)
        return dim, tag

    def ring(x: float, y: float, z: float, outer: float, inner: float) -> Entity:
        ((dim, tag),), _ = occ.cut([disc(x, y, z, outer)], [disc(x, y, z, inner)])
        return dim, tag

    screw, tip_screw = (part.base_screw_y, part.base_screw_z), (part.tip_screw_y, part.tip_screw_z)
    base = drill(base, 0.0, *screw, part.base_thickness, part.base_hole)
    tip = drill(tip, part.tip_x, *tip_screw, part.tip_thickness, part.tip_hole)
    # The rings that the screws press together carry the load: a clearance hole's wall touches nothing, and
    # the whole face would hold the flange rigid between the screws, where it can lift.
    rings = [
        ring(0.0, *screw, part.base_contact, part.base_hole),
        ring(part.height, *tip_screw, part.tip_contact, part.tip_hole),
    ]
    # Cutting everything with everything also makes neighbours share faces: one part, one mesh.
    _, pieces = occ.fragment([base, leaf, tip], rings)
    occ.synchronize()
    return Solid(leaf=pieces[1][0][1], contacts={"BASE": pieces[3][0][1], "TIP": pieces[4][0][1]})


# --- mesh ---


@contextmanager
def gmsh_session() -> Iterator[Any]:
    """gmsh, silent and without the user's own settings, so that everybody gets the same mesh."""
    try:
        import gmsh  # only who changes the part needs it
    except ImportError as error:
        raise SystemExit('gmsh, which meshes the flexure, is missing: pip install ".[mesh]"') from error
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)  # more threads, another mesh
        yield gmsh
    finally:
        gmsh.finalize()


def arrange_rows(model: Any, part: Flexure, leaf: int) -> None:
    """Mesh leaf and fillets in rows, longer than thick: a free mesh would need ten times as many elements."""
    mesh = model.mesh

    def rows(curve: int) -> tuple[int, str, float]:
        x_min, _, z_min, x_max, _, z_max = model.getBoundingBox(1, curve)
        if z_max - z_min > part.depth / 4:
            return part.rows_across, "Progression", 1.0
        if model.getType(1, curve) == "Circle":
            return part.rows_fillet, "Progression", 1.0
        if x_max - x_min > part.leaf_height / 2:
            return part.rows_along, "Bump", part.grading
        return part.rows_through, "Progression", 1.0

    def in_rows(face: int) -> None:
        for _, curve in model.getBoundary([(2, face)], oriented=False):
            count, law, ratio = rows(curve)
            mesh.setTransfiniteCurve(curve, count + 1, law, ratio)
        mesh.setTransfiniteSurface(face)

    for _, face in model.getEntities(2):
        if model.getType(2, face) == "Cylinder":  # a fillet: the holes are prisms
            in_rows(face)
    for _, face in model.getBoundary([(3, leaf)], oriented=False):
        in_rows(face)
        x_min, _, _, x_max, _, _ = model.getBoundingBox(2, face)
        if x_max - x_min < part.leaf_height / 2:
            # The leaf's ends: the diagonals that gmsh's rows of tetrahedra have there, so that leaf and flange share
            # whole faces. With its default they would hang together by edges only.
            mesh.setTransfiniteSurface(face, "Right")
    mesh.setTransfiniteVolume(leaf)


def mesh_quarter(part: Flexure) -> Mesh:
    """Second-order mesh of the quarter [m]; SystemExit names the worst element's quality if it is poor."""
    with gmsh_session() as gmsh:
        solid = quarter_solid(gmsh.model.occ, part)
        mesh = gmsh.model.mesh
        arrange_rows(gmsh.model, part, solid.leaf)
        gmsh.option.setNumber("Mesh.MeshSizeMax", part.size_flange)
        for source in ("FromPoints", "FromCurvature", "ExtendFromBoundary"):
            gmsh.option.setNumber(f"Mesh.MeshSize{source}", 0)  # the leaf's 1 mm would fill the flanges
        # Straight edges: around a fillet as coarse as this, curved ones would turn elements inside out.
        gmsh.option.setNumber("Mesh.SecondOrderLinear", 1)
        mesh.generate(3)
        mesh.setOrder(2)

        tags, coordinates, _ = mesh.getNodes()
        element_tags, connectivity = mesh.getElementsByType(mesh.getElementType("tetrahedron", 2))
        worst = float(min(mesh.getElementQualities(element_tags, "minSICN")))
        if worst < MIN_QUALITY:
            raise SystemExit(f"Worst element has SICN {worst:.3f} < {MIN_QUALITY}: change the element sizes.")
        used = np.unique(connectivity)  # gmsh also lists points that carry no element, such as arc centres
        row = np.full(int(tags.max()) + 1, -1)
        row[used] = np.arange(len(used))
        place = np.empty((len(row), 3))
        place[tags] = coordinates.reshape(-1, 3)
        return Mesh(
            nodes=place[used] * MM,
            elements=row[connectivity.reshape(-1, 10)[:, CALCULIX_FROM_GMSH]],
            sets={
                name: np.sort(row[mesh.getNodes(2, face, includeBoundary=True)[0]])
                for name, face in solid.contacts.items()
            },
        )


def mirror_mesh(mesh: Mesh, axis: int) -> Mesh:
    """Whole of a mesh that ends at the plane where the coordinate `axis` is zero.

    The mirror image shares the nodes on the plane. A mesh as symmetric as the part puts its CoG and its
    interfaces on the axis and keeps motions in and out of the plane of symmetry apart, to rounding.
    """
    on_plane = np.abs(mesh.nodes[:, axis]) < 1e-9
    nodes = mesh.nodes.copy()
    nodes[on_plane, axis] = 0.0
    image = np.arange(len(nodes))
    image[~on_plane] = len(nodes) + np.arange(np.count_nonzero(~on_plane))
    reflected = nodes[~on_plane]
    reflected[:, axis] *= -1.0
    return Mesh(
        nodes=np.vstack([nodes, reflected]),
        elements=np.vstack([mesh.elements, image[mesh.elements][:, REFLECTED]]),
        sets={name: np.unique(np.concatenate([rows, image[rows]])) for name, rows in mesh.sets.items()},
    )


def refuse_cracks(mesh: Mesh) -> None:
    """SystemExit where neighbours do not share whole faces: more than two outer faces meet at an edge."""
    skin = skin_of_solids([mesh.elements[:, :4]])
    edges = np.sort(np.vstack([skin[:, [0, 1]], skin[:, [1, 2]], skin[:, [2, 0]]]), axis=1)
    places, counts = np.unique(edges, axis=0, return_counts=True)
    if np.any(counts != 2):
        x, y, z = mesh.nodes[places[counts != 2][0, 0]] / MM
        raise SystemExit(f"The mesh has a crack near ({x:.1f}, {y:.1f}, {z:.1f}) mm: faces there are not shared.")


def mesh_part(part: Flexure) -> Mesh:
    """Mesh of the whole part [m]."""
    whole = mirror_mesh(mirror_mesh(mesh_quarter(part), axis=1), axis=2)
    refuse_cracks(whole)
    if np.intersect1d(whole.sets["BASE"], whole.sets["TIP"]).size:
        raise SystemExit("BASE and TIP share nodes: the flanges are too close to each other.")
    # Neighbours and mirror images get neighbouring labels: gzip then makes the matrices a quarter smaller.
    x, y, z = whole.nodes.T
    order = np.lexsort((z > 0.0, y > 0.0, np.abs(z), np.abs(y), x))
    new = np.argsort(order)
    return Mesh(
        nodes=whole.nodes[order],
        elements=new[whole.elements],
        sets={name: np.sort(new[rows]) for name, rows in whole.sets.items()},
    )


# --- CalculiX ---


def labels(rows: Iterable[int], per_line: int = 12) -> Iterator[str]:
    """Node labels (from 1) of the rows, in lines short enough for CalculiX (132 characters, 16 entries)."""
    numbers = [str(row + 1) for row in rows]
    for start in range(0, len(numbers), per_line):
        yield ", ".join(numbers[start : start + per_line])


def input_deck(mesh: Mesh, material: Material) -> str:
    """CalculiX deck of the free part that stores its matrices."""
    lines = [f"** Adjustment flexure of the mirror module, SI units; written by {Path(__file__).name}"]
    lines.append("*NODE, NSET=NALL")
    lines += [f"{i}, {x:.9f}, {y:.9f}, {z:.9f}" for i, (x, y, z) in enumerate(mesh.nodes, start=1)]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=EALL")
    lines += [f"{i}, " + ", ".join(map(str, row + 1)) for i, row in enumerate(mesh.elements, start=1)]
    for name, rows in mesh.sets.items():
        lines += [f"*NSET, NSET={name}", *labels(rows)]
    lines += [
        f"*MATERIAL, NAME={material.name}",
        "*ELASTIC",
        f"{material.youngs_modulus:.6g}, {material.poisson_ratio:.6g}",
        "*DENSITY",
        f"{material.density:.6g}",
        f"*SOLID SECTION, ELSET=EALL, MATERIAL={material.name}",
        "*STEP",
        "*FREQUENCY, SOLVER=MATRIXSTORAGE",
        "20",  # number of modes: asked for by the card, not used when only storing
        "*END STEP",
    ]
    return "\n".join(lines) + "\n"


def run_calculix(folder: Path) -> None:
    """Run the job in `folder`; raises SystemExit with CalculiX's last words unless all matrices are there."""
    ccx = shutil.which("ccx")
    if ccx is None:
        raise SystemExit("ccx, which writes the matrices, is missing: apt-get install calculix-ccx")
    run = subprocess.run([ccx, JOB], cwd=folder, capture_output=True, text=True)
    missing = [kind for kind in ("sti", "mas", "dof") if not (folder / f"{JOB}.{kind}").is_file()]
    if run.returncode != 0 or missing:
        words = "\n".join((run.stdout + run.stderr).splitlines()[-15:])
        raise SystemExit(f"ccx failed (return code {run.returncode}, missing {missing}):\n{words}")


# --- pack ---


def pack(folder: Path, export: Path) -> None:
    """Put the job's deck and gzipped matrices into `export`, after all of them are ready."""
    export.mkdir(exist_ok=True)
    # On the same disk as the export, so that each file arrives by renaming: whole or not at all.
    with tempfile.TemporaryDirectory(dir=export.parent, prefix=".packing-") as staging:
        ready = [Path(shutil.copy(folder / f"{JOB}.inp", staging))]
        for kind in ("sti", "mas", "dof"):
            packed = Path(staging) / f"{JOB}.{kind}.gz"
            content = (folder / f"{JOB}.{kind}").read_bytes()
            packed.write_bytes(gzip.compress(content, compresslevel=9, mtime=0))  # same part, same bytes
            ready.append(packed)
        for path in ready:
            path.chmod(0o644)
            os.replace(path, export / path.name)


def main() -> None:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / f"{JOB}.inp").write_text(input_deck(mesh_part(Flexure()), Material()))
        run_calculix(folder)
        pack(folder, EXPORT)


if __name__ == "__main__":
    main()
