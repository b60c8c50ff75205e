import os
import sys
from pathlib import Path

import pytest

os.environ.setdefault("MPLBACKEND", "Agg")
sys.path.insert(0, str(Path(__file__).parent))
pytest_plugins = ["validation"]

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture
def shared():
    """Published cases and real exports that lie beside the repository, where they do."""
    if not SHARED.is_dir():
        pytest.skip(f"{SHARED} is not on this machine (published cases and real FE exports)")
    return SHARED


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
