"""What the tests of every reader share: comparing models, damaging files, finding the samples."""

import random
import warnings
from pathlib import Path

import numpy as np
import pytest

import fem_import as fi

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"


def sample(*parts):
    """A real export beside the repository; skips where it is not there."""
    path = DATA.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{path} is not on this machine (a real export, not ours to pass on)")
    return path


def in_node_order(part):
    order = np.lexsort((part.dofs[:, 1], part.dofs[:, 0]))
    return part.K.toarray()[np.ix_(order, order)], part.M.toarray()[np.ix_(order, order)]


def assert_same_part(part, own, digits=15):
    """K, M, positions as the part that was written; its DoF are sorted by node."""
    K, M = in_node_order(part)
    for read, written in ((K, own.K.toarray()), (M, own.M.toarray())):
        np.testing.assert_allclose(read, written, rtol=0, atol=3 * 10.0 ** (-digits) * abs(written).max())
    np.testing.assert_allclose(part.positions[np.argsort(part.node_ids)], own.positions, rtol=1e-13, atol=1e-18)


def damaged(content, chance):
    """A few bytes changed, removed, doubled or cut."""
    content = bytearray(content)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(max(len(content), 1))
        kind = chance.randrange(5)
        if kind == 0:
            content[at : at + 1] = bytes([chance.choice(b"0123456789+-.eED*,= \n\x00\xffnax")])
        elif kind == 1:
            del content[at : at + chance.randint(1, 40)]
        elif kind == 2:
            content[at:at] = content[at : at + chance.randint(1, 40)]
        elif kind == 3:
            content[at:at] = b"99999999999"
        else:
            del content[max(at, 1) :]
    return bytes(content)


def assert_damage_is_answered(folder, read, seeds, at_least=None):
    """Damage each file in turn: our error in words, or a consistent model; never anything else."""
    files = sorted(file for file in folder.iterdir() if file.is_file())
    originals = {file: file.read_bytes() for file in files}
    refused = 0
    for seed in seeds:
        chance = random.Random(seed)
        target = files[seed % len(files)]
        target.write_bytes(damaged(originals[target], chance))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", fi.ExportWarning)
            try:
                found = read()
            except fi.FemImportError as error:
                refused += 1
                words = str(error)
            else:
                words = str(found.report() if isinstance(found, fi.FEModel) else found)
                assert found.K.shape == found.M.shape
        assert len(words) > 20
        target.write_bytes(originals[target])
    assert refused >= (len(seeds) // 4 if at_least is None else at_least)
