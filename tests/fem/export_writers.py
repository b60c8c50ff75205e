"""Write one part in the formats of other programs, 16 digits unless asked otherwise. K and M as (n, n) sparse."""

import numpy as np
from scipy import sparse


def triangle(matrix, lower=True):
    """Column-ordered entries (row, column, value) of one triangle, base 0."""
    part = sparse.csc_array((sparse.tril if lower else sparse.triu)(matrix))
    part.sort_indices()
    columns = np.repeat(np.arange(part.shape[1]), np.diff(part.indptr))
    return part.indices, columns, part.data


def scrambled(model, seed=5):
    """The model with its rows in another order, as solvers leave them."""
    order = np.random.default_rng(seed).permutation(len(model.dofs))
    K, M = (sparse.csr_array(sparse.csr_array(matrix)[order][:, order]) for matrix in (model.K, model.M))
    return K, M, np.asarray(model.dofs)[order]


def fortran_double(value, digits=16):
    return f"{value:.{digits - 1}E}".replace("E", "D")


def write_harwell_boeing(path, matrix, digits=16, rhs=True):
    rows, columns, values = triangle(matrix)
    n = matrix.shape[0]
    pointers = np.searchsorted(columns, np.arange(n + 1)) + 1
    lines = [f"{'Assembled matrix':72s}{'KEY':8s}"]
    n_rhs = n if rhs else 0
    lines.append("".join(f"{k:14d}" for k in (n + 1 + 2 * len(values) + n_rhs, n + 1, len(values), len(values), n_rhs)))
    lines.append(f"RSA           {n:14d}{n:14d}{len(values):14d}{0:14d}")
    lines.append(f"{'(1I14)':16s}{'(1I14)':16s}{'(1D25.15)':20s}{'(1D25.15)':20s}")
    if rhs:
        lines.append(f"F             {1:14d}{0:14d}")
    lines += [f"{p:14d}" for p in pointers]
    lines += [f"{r + 1:14d}" for r in rows]
    lines += [f"{fortran_double(v, digits):>25s}" for v in values]
    lines += ["      0.000000000000000D+00"] * n_rhs
    path.write_text("\n".join(lines) + "\n")


def write_mapping(path, dofs):
    names = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
    body = "".join(f"{k:9d}{node:9d}    {names[d - 1]}\n" for k, (node, d) in enumerate(dofs.tolist(), start=1))
    path.write_text("   Matrix Eqn    Node    DOF\n" + body)


def write_cdb(path, model):
    lines = ["/PREP7", f"NBLOCK,6,SOLID,{len(model.positions):10d},{len(model.positions):10d}", "(3i9,6e21.13e3)"]
    for label, position in enumerate(model.positions.tolist(), start=1):
        fields = "".join(f"{value:21.13E}"[:-2] + "0" + f"{value:21.13E}"[-2:] for value in position)
        lines.append(f"{label:9d}{0:9d}{0:9d}" + "".join(f[-21:] for f in _chunks(fields, 22)))
    lines.append("N,R5.3,LOC,       -1,")
    for name, nodes in model.node_sets.items():
        items = compressed(nodes)
        lines += [f"CMBLOCK,{name:8s},NODE,{len(items):8d}  ! component", "(8i10)"]
        lines += ["".join(f"{item:10d}" for item in items[at : at + 8]) for at in range(0, len(items), 8)]
    path.write_text("\n".join(lines) + "\nFINISH\n")


def _chunks(text, size):
    return [text[at : at + size] for at in range(0, len(text), size)]


def compressed(nodes):
    """1 2 3 7 -> 1 -3 7, as components are written."""
    items = []
    for node in nodes.tolist():
        if items and node == abs(items[-1]) + 1:
            if items[-1] < 0:
                items[-1] = -node
            else:
                items.append(-node)
        else:
            items.append(node)
    return items


def write_hbmat_job(folder, model, digits=16):
    """stiff.matrix, mass.matrix with their mappings, and stiff.cdb."""
    folder.mkdir(exist_ok=True)
    K, M, dofs = scrambled(model)
    for name, matrix in (("stiff", K), ("mass", M)):
        write_harwell_boeing(folder / f"{name}.matrix", matrix, digits)
        write_mapping(folder / f"{name}.mapping", dofs)
    write_cdb(folder / "stiff.cdb", model)
    return folder / "stiff.matrix"


def write_coordinate(path, matrix, symmetric=True, comment="% Creator: ANSYS Inc\n", digits=16):
    if symmetric:
        rows, columns, values = triangle(matrix)
    else:
        entries = sparse.coo_array(matrix)
        rows, columns, values = entries.row, entries.col, entries.data
    kind = "symmetric" if symmetric else "general"
    text = f"%%MatrixMarket matrix coordinate real {kind}\n{comment}{matrix.shape[0]} {matrix.shape[1]} {len(values)}\n"
    lines = zip((rows + 1).tolist(), (columns + 1).tolist(), values.tolist(), strict=True)
    path.write_text(text + "".join(f"{i} {j} {v:.{digits - 1}E}\n" for i, j, v in lines))


def write_ansys_mmf_job(folder, model):
    """Matrices by *EXPORT with nodes in another order, the vector of node numbers, a table with decimal commas."""
    folder.mkdir(exist_ok=True)
    labels = np.random.default_rng(3).permutation(len(model.positions)) + 1
    order = (3 * (labels - 1)[:, None] + np.arange(3)).ravel()
    for name, matrix in (("Stiffness", model.K), ("Mass", model.M)):
        write_coordinate(folder / f"part{name}.txt", sparse.csr_array(sparse.csr_array(matrix)[order][:, order]))
    vector = "".join(f"{label}\n" for label in labels)
    (folder / "map.txt").write_text(f"%%MatrixMarket matrix array integer general\n%\n{len(labels)} 1\n{vector}")
    rows = "".join(
        f"{label}\t" + "\t".join(f"{x:.16g}".replace(".", ",") for x in model.positions[label - 1].tolist()) + "\t\n"
        for label in sorted(labels.tolist())
    )
    (folder / "nodes.txt").write_text("Knotennummer\tX-Position (m)\tY-Position (m)\tZ-Position (m)\t\n" + rows)
    return folder / "partStiffness.txt"


def abaqus_lines(matrix, dofs, layout):
    if layout == "COORDINATE":
        entries = sparse.coo_array(matrix)
        found = zip((entries.row + 1).tolist(), (entries.col + 1).tolist(), entries.data.tolist(), strict=True)
        return "".join(f"{i} {j} {v: .15e}\n" for i, j, v in found)
    rows, columns, values = triangle(matrix, lower=False)
    pairs = zip(dofs[columns].tolist(), dofs[rows].tolist(), values.tolist(), strict=True)
    if layout == "LABELS":
        return "".join(f"{a} {b} {c} {d} {v: .15e}\n" for (a, b), (c, d), v in pairs)
    return "".join(f"{a},{b}, {c},{d}, {v: .15e}\n" for (a, b), (c, d), v in pairs)


def abaqus_deck(model, parts=True, instance_lines=""):
    nodes = "".join(f"{i:7d}, {x!r}, {y!r}, {z!r}\n" for i, (x, y, z) in enumerate(model.positions.tolist(), start=1))

    def sets(extra):
        return "".join(
            f"*Nset, nset={name}{extra}\n" + "".join(f"{node},\n" for node in members.tolist())
            for name, members in model.node_sets.items()
        )

    if not parts:
        return f"*Heading\n*Node\n{nodes}{sets('')}"
    return (
        f"*Part, name=block\n*Node\n{nodes}*End Part\n*Assembly, name=Assembly\n*Instance, name=block-1, part=block\n"
        f"{instance_lines}*End Instance\n{sets(', instance=block-1')}*End Assembly\n"
    )


def write_abaqus_job(folder, model, layout="MATRIX INPUT", **deck):
    folder.mkdir(exist_ok=True)
    for kind, matrix in (("STIF", model.K), ("MASS", model.M)):
        (folder / f"job_{kind}1.mtx").write_text(abaqus_lines(matrix, np.asarray(model.dofs), layout))
    (folder / "job.inp").write_text(abaqus_deck(model, **deck))
    return folder / "job.inp"


def _record(kind, words):
    words = np.asarray(words)
    words = words.astype("<f8").view("<i4") if words.dtype.kind == "f" else words.astype("<i4")
    return np.concatenate([[len(words), kind], words, [len(words)]]).astype("<i4")


def write_full(path, model, constrained=(), nodes_first=None):
    """A .full file of Ansys with three DoF a node; rows of `constrained` nodes hold 1 on the diagonal only."""
    whole, real = np.uint32(0x80000000).astype("<i4"), 0
    labels = np.arange(1, len(model.positions) + 1) if nodes_first is None else np.asarray(nodes_first)
    order = (3 * (labels - 1)[:, None] + np.arange(3)).ravel()
    held = np.isin(np.repeat(labels, 3), constrained)
    n = len(order)
    header = np.zeros(160, np.int64)
    header[[0, 1, 2, 3, 4, 6, 7, 11, 32]] = [-4, n, n, 2, 2, len(labels), 3, n, len(labels)]
    standard = np.zeros(100, np.int64)
    standard[:2] = [4, -1]
    parts = [_record(whole, standard), _record(whole, header), _record(whole, [1, 2, 3]), _record(whole, labels)]

    def place():
        return sum(map(len, parts))

    for matrix, at, count in ((model.K, 18, 8), (model.M, 26, 33)):
        header[at] = place()
        dense = sparse.csr_array(matrix).toarray()[np.ix_(order, order)]
        dense[held] = dense[:, held] = 0.0
        if at == 18:
            dense[held, held] = 1.0
        for row in range(n):
            columns = np.flatnonzero(dense[row, row + 1 :]) + row + 1
            columns = np.append(columns, row)
            header[count] += len(columns)
            parts += [_record(whole, columns + 1), _record(real, dense[row, columns])]
    header[35] = place()
    windowed = np.uint32(0x90000000).astype("<i4")
    parts += [_record(windowed, [len(labels), 1, 0, -len(labels), 3])]
    parts += [_record(whole, np.tile([1, 2, 3], len(labels)) * np.where(held, -1, 1))]
    parts[1] = _record(whole, header)
    path.write_bytes(np.concatenate(parts).tobytes())


DIRECTION_NAMES = ("x", "y", "z", "rx", "ry", "rz")


def write_dof_table(path, model, separator=",", by_name=False):
    lines = [separator.join(("node", "direction", "x", "y", "z", "sets"))]
    for node, direction in np.asarray(model.dofs).tolist():
        position = [repr(x) for x in model.positions[node - 1].tolist()]
        sets = "|".join(name for name, nodes in model.node_sets.items() if node in nodes)
        lines.append(
            separator.join([str(node), DIRECTION_NAMES[direction - 1] if by_name else str(direction), *position, sets])
        )
    path.write_text("\n".join(lines) + "\n")


def write_matrix_market_job(folder, model):
    folder.mkdir(exist_ok=True)
    write_coordinate(folder / "part_K.mtx", model.K, comment="")
    write_coordinate(folder / "part_M.mtx", model.M, comment="", symmetric=False)
    write_dof_table(folder / "dofs.csv", model)
    return folder / "part_K.mtx"


def grid_cards(model):
    cards = ""
    for label, (x, y, z) in enumerate(model.positions.tolist(), start=1):
        cards += f"GRID*   {label:16d}{'':16s}{x:16.9E}{y:16.9E}\n*       {z:16.9E}\n"
    return cards


def punch(name, matrix, dofs, digits=10, large=True):
    """DMIG cards of the lower triangle of a symmetric matrix, in large or small field."""
    text = f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}{'':16s}{len(dofs):8d}\n"
    lower = sparse.csc_array(sparse.tril(matrix))
    for column in range(lower.shape[1]):
        node, component = dofs[column]
        found = slice(lower.indptr[column], lower.indptr[column + 1])
        terms = [(*dofs[row], value) for row, value in zip(lower.indices[found], lower.data[found], strict=True)]
        if large:
            text += f"DMIG*   {name:16s}{node:16d}{component:16d}\n"
            text += "".join(f"*       {g:16d}{c:16d}{v:16.{digits - 1}E}\n".replace("E", "D") for g, c, v in terms)
        else:
            g, c, v = terms[0]
            text += f"DMIG    {name:8s}{node:8d}{component:8d}{'':8s}{g:8d}{c:8d}{short(v)}\n"
            text += "".join(f"        {g:8d}{c:8d}{short(v)}\n" for g, c, v in terms[1:])
    return text


def short(value):
    """Nastran's 8 characters: 1.23-4 for 1.23e-4."""
    for digits in range(5, -1, -1):
        mantissa, exponent = f"{value:.{digits}e}".split("e")
        text = f"{mantissa}{int(exponent):+d}"
        if len(text) <= 8:
            return f"{text:>8s}"
    raise AssertionError(value)


def write_punch(folder, model, **how):
    folder.mkdir(exist_ok=True)
    path = folder / "part.pch"
    dofs = np.asarray(model.dofs).tolist()
    path.write_text(
        "".join(punch(n, m, dofs, **how) for n, m in (("KAAX", model.K), ("MAAX", model.M))) + grid_cards(model)
    )
    return path
