"""Numbers held against others, and the file that the validation page of the documentation is made from.

A test that takes the fixture ``validated`` compares through it; ``pytest --validation=FILE`` runs only those tests and
writes what was expected and found as JSON.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

PROPERTY = "validated"
AGAINST = ("published cases", "closed forms", "other programs", "calculations by hand", "runs in time", "statistics")


@pytest.fixture
def validated(request: pytest.FixtureRequest, record_property: Callable[[str, object], None]) -> Callable[..., None]:
    """Return the function that compares a number, or several, and notes both for the validation page.

    validated(name, source, expected, found, rtol=..., against="published cases", unit="Hz"): ``rtol`` of each number's
    own size, or ``atol`` in its unit. ``source`` says where the expected number comes from.
    """

    def check(
        name: str,
        source: str,
        expected: Any,
        found: Any,
        *,
        rtol: float | None = None,
        atol: float | None = None,
        against: str,
        unit: str = "",
    ) -> None:
        assert against in AGAINST
        assert (rtol is None) != (atol is None), "either rtol or atol"
        wanted, got = np.atleast_1d(np.asarray(expected, dtype=float)), np.atleast_1d(np.asarray(found, dtype=float))
        assert wanted.shape == got.shape
        difference = np.abs(got - wanted)
        deviation = difference / np.abs(wanted) if rtol is not None else difference
        record_property(
            PROPERTY,
            {
                "name": name,
                "source": source,
                "against": against,
                "unit": unit,
                "expected": wanted.ravel().tolist(),
                "found": got.ravel().tolist(),
                "deviation": float(deviation.max()),
                "tolerance": float(rtol if rtol is not None else atol),  # type: ignore[arg-type]  # one of them is there
                "relative": rtol is not None,
                "test": request.node.nodeid.split("[")[0],
            },
        )
        np.testing.assert_allclose(got, wanted, rtol=rtol or 0.0, atol=atol or 0.0, err_msg=name)

    return check


def pytest_addoption(parser: pytest.Parser) -> None:
    what = "run the tests of the validation page and write what they find"
    parser.addoption("--validation", metavar="FILE", help=what)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--validation"):
        chosen = [item for item in items if "validated" in getattr(item, "fixturenames", ())]
        config.hook.pytest_deselected(items=[item for item in items if item not in chosen])
        items[:] = chosen


class Collector:
    """Gathers what the tests found, in processes of their own too, and writes it at the end."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.found: dict[str, list[dict[str, Any]]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call":
            self.found[report.nodeid] = [value for name, value in report.user_properties if name == PROPERTY]

    def pytest_sessionfinish(self) -> None:
        checks = [check for nodeid in sorted(self.found) for check in self.found[nodeid]]
        checks.sort(key=lambda check: AGAINST.index(check["against"]))
        self.path.write_text(json.dumps(checks, indent=1), encoding="utf-8")


def pytest_configure(config: pytest.Config) -> None:
    path = config.getoption("--validation")
    if path and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Collector(Path(path)))
