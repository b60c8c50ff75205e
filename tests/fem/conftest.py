import shutil
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # own_fe


@pytest.fixture(scope="session")
def leaf_spring_file():
    """The real leaf spring beside the repository."""
    path = Path(__file__).resolve().parents[3] / "shared" / "data" / "calculix_leafspring" / "free_ms.inp"
    if not path.is_file():
        pytest.skip(f"{path} is not on this machine (a real CalculiX export of 15 k DoF)")
    return path


@pytest.fixture(scope="session")
def leaf_spring(leaf_spring_file):
    import fem_import as fi

    return fi.read_calculix(leaf_spring_file)


@pytest.fixture(scope="session")
def run_ccx():
    """Run CalculiX on a deck; skips where it is not installed."""
    program = shutil.which("ccx")
    if program is None:
        pytest.skip("ccx (CalculiX) is not installed")

    def run(deck: Path) -> None:
        subprocess.run([program, deck.stem], cwd=deck.parent, check=True, capture_output=True, timeout=60)

    return run


@pytest.fixture(scope="session")
def flexure_body():
    """The flexure of the example, reduced."""
    import fem_import as fi

    export = Path(__file__).resolve().parents[2] / "examples" / "mirror_flexure" / "flexure.inp"
    return fi.reduce(fi.read_calculix(export), {"base": "BASE", "tip": "TIP"}, max_frequency=8000.0)
