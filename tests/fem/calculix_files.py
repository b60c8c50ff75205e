"""Write CalculiX decks and, from matrices of our own, the files ccx would export."""

import numpy as np
from scipy import sparse

MATERIAL = "*MATERIAL,NAME=STEEL\n*ELASTIC\n2.1e11,0.3\n*DENSITY\n7850.\n*SOLID SECTION,ELSET=EALL,MATERIAL=STEEL\n"


def deck_text(model, solver="MATRIXSTORAGE", n_modes=10, extra=""):
    nodes = "".join(f"{i}, {x!r}, {y!r}, {z!r}\n" for i, (x, y, z) in enumerate(model.positions.tolist(), start=1))
    elements = "".join(
        f"{i}, {', '.join(map(str, nodes_of))}\n" for i, nodes_of in enumerate(model.elements.tolist(), start=1)
    )
    sets = "".join(
        f"*NSET,NSET={name}\n" + "".join(f"{node},\n" for node in nodes.tolist())
        for name, nodes in model.node_sets.items()
    )
    step = f"*STEP\n*FREQUENCY,SOLVER={solver}\n{n_modes}\n*END STEP\n"
    return f"*NODE,NSET=NALL\n{nodes}*ELEMENT,TYPE=C3D8,ELSET=EALL\n{elements}{sets}{MATERIAL}{extra}{step}"


def write_export(folder, model, job="job", digits=14):
    """Write job.inp, .sti, .mas and .dof in the formats of ccx."""
    folder.mkdir(exist_ok=True)
    (folder / f"{job}.inp").write_text(deck_text(model))
    pattern = sparse.triu(model.K).tocsc()
    columns = np.repeat(np.arange(pattern.shape[1]), np.diff(pattern.indptr))
    for suffix, matrix in ((".sti", model.K), (".mas", model.M)):
        values = np.asarray(matrix.tocsr()[pattern.indices, columns]).ravel()
        lines = zip(pattern.indices + 1, columns + 1, values, strict=True)
        text = "".join(f"{i} {j} {v:20.{digits - 1}e}\n" for i, j, v in lines)
        (folder / f"{job}{suffix}").write_text(text)
    (folder / f"{job}.dof").write_text("".join(f"{node}.{direction}\n" for node, direction in model.dofs))
    return folder / f"{job}.inp"
