"""History: what is recorded, what changed, and that nothing gets lost."""

import math
import os
import random
import signal
import sqlite3
import subprocess
import sys
import textwrap
import time
from itertools import pairwise

import numpy as np
import pytest

import fem_import as fi
import ibsdyn as ibs
from ibsdyn.provenance import input_hash

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def oscillator(mass=2.0, stiffness=5e4, limit=20.0, name="oscillator"):
    model = ibs.Model(name, axis="x")
    model.fixation("wall")
    model.rigid_body("block", mass=mass)
    model.connection("spring", "wall", "block", stiffness=stiffness, zeta=0.01)
    model.add_requirement(ibs.Requirement("first mode", ibs.ModeFrequency(1), limit, ">="))
    return model


def hertz(mass, stiffness):
    return math.sqrt(stiffness / mass) / (2 * math.pi)


def box(mass=2.0):
    model = ibs.Model("box")
    model.fixation("wall", position=(0, 0, 0))
    model.rigid_body("block", mass=mass, cog=(0, 0, 0.05), inertia=(0.01, 0.01, 0.01, 0, 0, 0))
    model.connection(
        "spring", "wall", "block", position1=(0, 0, 0.05), stiffness=(5e4, 9e9, 9e9, 9e9, 9e9, 9e9), zeta=0.01
    )
    model.add_requirement(ibs.Requirement("first mode", ibs.ModeFrequency(1), 20.0, ">="))
    return model


def test_a_revision_keeps_what_was_predicted(tmp_path):
    history = ibs.History(tmp_path / "h.db")
    assert history.revisions == ()
    assert not (tmp_path / "h.db").exists(), "looking makes no file"
    first = history.record(oscillator(), note="sized by hand")
    second = history.record(oscillator(mass=4.0, limit=20.0), revision="B")
    assert (first.name, first.number, first.fidelity, first.note) == ("1", 1, "1-D", "sized by hand")
    (result,) = first.results
    assert (result.unit, result.limit, result.sense, result.met) == ("Hz", 20.0, ">=", True)
    assert result.value == pytest.approx(hertz(2.0, 5e4), rel=1e-12)
    assert second.result("first mode").value == pytest.approx(hertz(4.0, 5e4), rel=1e-12)
    assert second.met is False
    assert first.parameters == {"block.mass": 2.0, "spring.stiffness": 5e4, "spring.zeta": 0.01}
    assert set(first.versions) == {"python", "ibsdyn", "exudyn", "numpy", "scipy"}
    assert abs(time.time() - first.date.timestamp()) < 120
    again = ibs.History(tmp_path / "h.db")
    assert again.revisions == (first, second)
    assert again["B"] == second
    assert "NOT MET" in str(again)
    with pytest.raises(ibs.UnknownNameError, match=r"Did you mean 'B'|Known"):
        again["b"]


def test_infinite_stiffness_and_hostile_texts_come_back(tmp_path):
    model = box()
    model.remove("spring")
    model.connection("spring", "wall", "block", position1=(0, 0, 0.05), stiffness=(5e4, *[math.inf] * 5), zeta=0.01)
    note = "'); DROP TABLE revisions; -- \0 \n µ 🙂"
    history = ibs.History(tmp_path / "h.db")
    revision = history.record(model, note=note, revision='B"; --')
    assert revision.parameters["spring.ky"] == math.inf
    assert history.revisions[0].note == note
    assert history['B"; --'].met


def test_the_input_hash_follows_every_number_and_no_name_of_the_model():
    model = box()
    own = input_hash(model)
    assert input_hash(box()) == own
    assert input_hash(model.copy("another name")) == own
    for address, value in model.parameters().items():
        assert input_hash(model.with_parameters({address: value * (1 + 1e-9) + 1e-12})) != own, address
    other = box()
    other.add_sensor(ibs.Sensor("block", "x"))
    assert input_hash(other) != own
    other = box()
    other.remove("first mode")
    other.add_requirement(ibs.Requirement("first mode", ibs.ModeFrequency(1), 21.0, ">="))
    assert input_hash(other) != own


def test_a_difference_makes_each_change_by_itself(tmp_path):
    history = ibs.History(tmp_path / "h.db")
    history.record(oscillator(2.0, 5e4), revision="A")
    history.record(oscillator(3.0, 8e4), revision="B")
    difference = history.diff("A", "B")
    assert {c.address: (c.before, c.after) for c in difference.changed} == {
        "block.mass": (2.0, 3.0),
        "spring.stiffness": (5e4, 8e4),
    }
    (effect,) = difference.effects
    base = hertz(2.0, 5e4)
    assert effect.total == pytest.approx(hertz(3.0, 8e4) - base, rel=1e-9)
    assert effect.contributions["block.mass"] == pytest.approx(hertz(3.0, 5e4) - base, rel=1e-9)
    assert effect.contributions["spring.stiffness"] == pytest.approx(hertz(2.0, 8e4) - base, rel=1e-9)
    together = hertz(3.0, 8e4) - hertz(3.0, 5e4) - hertz(2.0, 8e4) + base
    assert effect.remainder == pytest.approx(together, rel=1e-9)
    assert difference.notes == ()
    assert "block.mass: 2 -> 3 (+50 %)" in str(difference)
    backwards = history.diff("B", "A").effects[0]
    assert backwards.total == pytest.approx(-effect.total, rel=1e-12)


def test_concept_and_space_follow_each_other(tmp_path):
    history = ibs.History(tmp_path / "h.db")
    history.record(oscillator(), revision="concept")
    history.record(box(), revision="in space")
    difference = history.diff("concept", "in space")
    assert [r.fidelity for r in history.revisions] == ["1-D", "3-D"]
    assert [c.address for c in difference.changed] == []
    assert "spring.stiffness" in difference.vanished
    assert {"block.cog.z", "spring.kx", "wall.position.x"} <= set(difference.appeared)
    assert "block.mass" not in difference.appeared, "both have it"
    (effect,) = difference.effects
    # the stiff directions shift the first mode by no more than their share of compliance
    assert effect.total == pytest.approx(0.0, abs=1e-3 * effect.before.value)
    text = str(difference)
    assert "gone: spring (stiffness)" in text
    assert "new: wall (position.x, position.y, position.z)" in text


def test_requirements_that_come_and_go_and_change_their_limit(tmp_path):
    history = ibs.History(tmp_path / "h.db")
    model = oscillator()
    history.record(model, revision="A")
    model.remove("first mode")
    model.add_requirement(ibs.Requirement("damping", ibs.ModeDamping(1), 0.005, ">="))
    history.record(model, revision="B")
    history.record(oscillator(limit=30.0), revision="C")
    words = str(history.diff("A", "B"))
    assert "gone: first mode" in words
    assert "new: damping" in words
    words = str(history.diff("A", "C"))
    assert "limit 20 -> 30 Hz" in words
    assert "NO LONGER MET" in words
    assert "no parameter changed" in words
    assert "requirement is another" in words


def test_a_requirement_without_value_is_recorded_with_the_reason(tmp_path):
    model = oscillator()
    model.add_requirement(ibs.Requirement("third mode", ibs.ModeFrequency(3), 50.0, ">="))
    history = ibs.History(tmp_path / "h.db")
    with pytest.warns(ibs.HistoryWarning, match="third mode"):
        history.record(model)
    result = history["1"].result("third mode")
    assert math.isnan(result.value)
    assert not result.met
    assert "mode 3 does not exist" in result.problem
    history.plot()


def flexible():
    """A free superelement: two interfaces, a unit beam-like spring between two lumps."""
    lever = np.eye(6)
    lever[1, 5], lever[2, 4] = -0.1, 0.1  # interface 2 lies 0.1 m along x from interface 1
    rows = np.hstack([-np.linalg.inv(lever), np.eye(6)])
    K = rows.T @ np.diag([1e6, 2e6, 3e6, 1e3, 2e3, 3e3]) @ rows
    M = np.diag([0.2, 0.2, 0.2, 1e-4, 1e-4, 1e-4] * 2)
    return fi.ReducedBody.from_arrays(0.5 * (M + M.T), 0.5 * (K + K.T), {"a": (0, 0, 0), "b": (0.1, 0, 0)})


def test_a_flexible_body_is_kept_once_and_the_model_rebuilt(tmp_path):
    model = ibs.Model("hybrid")
    model.fixation("wall", position=(0, 0, 0))
    model.flexible_body("arm", flexible(), zeta=0.01)
    model.connection("clamp", "wall", "arm.a", stiffness=(1e7,) * 3 + (1e4,) * 3, zeta=0.02)
    model.add_requirement(ibs.Requirement("first mode", ibs.ModeFrequency(1), 1.0, ">="))
    history = ibs.History(tmp_path / "h.db")
    first = history.record(model)
    history.record(model.with_parameters({"clamp.kx": 2e7}))
    assert first.fidelity == "hybrid"
    rebuilt = history.model("1")
    assert rebuilt == model
    assert input_hash(rebuilt) == first.input_hash
    (count,) = sqlite3.connect(tmp_path / "h.db").execute("SELECT COUNT(*) FROM contents").fetchone()
    assert count == 1
    (change,) = history.diff("1", "2").changed
    assert (change.address, change.after) == ("clamp.kx", 2e7)


class Stubborn:
    """A quantity of the user's own, which no model file knows."""

    name, unit = "static sag", "m"

    def evaluate(self, system):
        return 9.81 * 2.0 / float(system.K[0, 0])


def test_what_cannot_be_written_is_recorded_by_its_numbers(tmp_path):
    model = oscillator()
    model.add_requirement(ibs.Requirement("sag", Stubborn(), 1e-3))
    history = ibs.History(tmp_path / "h.db")
    with pytest.warns(ibs.HistoryWarning, match="cannot be rebuilt"):
        history.record(model, revision="A")
    with pytest.warns(ibs.HistoryWarning):
        history.record(model.with_parameters({"spring.stiffness": 6e4}), revision="B")
    assert history["A"].result("sag").value == pytest.approx(9.81 * 2 / 5e4)
    with pytest.raises(ibs.HistoryError, match="cannot be rebuilt"):
        history.model("A")
    difference = history.diff("A", "B")
    assert difference.changed[0].address == "spring.stiffness"
    assert all(not effect.contributions for effect in difference.effects)
    assert "not known" in difference.notes[0]


def test_names_are_never_overwritten(tmp_path):
    history = ibs.History(tmp_path / "h.db")
    history.record(oscillator(), revision="2")
    with pytest.raises(ibs.HistoryError, match=r"'2' was recorded on .*another name"):
        history.record(oscillator(), revision="2")
    assert history.record(oscillator()).name == "3", "the number 2 is taken as a name"
    assert len(history) == 2


def test_other_files_are_refused_in_words(tmp_path):
    text = tmp_path / "notes.txt"
    text.write_text("revision A is fine\n" * 100)
    with pytest.raises(ibs.HistoryError, match="is no history of ibsdyn"):
        ibs.History(text)
    assert text.read_text().startswith("revision A"), "and left as they are"
    other = tmp_path / "other.db"
    with sqlite3.connect(other) as connection:
        connection.execute("CREATE TABLE addresses (name TEXT)")
    with pytest.raises(ibs.HistoryError, match="SQLite file, but no history"):
        ibs.History(other)
    newer = tmp_path / "newer.db"
    ibs.History(newer).record(oscillator())
    with sqlite3.connect(newer) as connection:
        connection.execute("PRAGMA user_version = 99")
    with pytest.raises(ibs.HistoryError, match=r"newer ibsdyn \(format 99"):
        ibs.History(newer)
    with pytest.raises(ibs.HistoryError, match="is a folder"):
        ibs.History(tmp_path)
    with pytest.raises(ibs.HistoryError, match="does not exist"):
        ibs.History(tmp_path / "nowhere" / "h.db")


def test_a_damaged_file_is_refused(tmp_path):
    path = tmp_path / "h.db"
    history = ibs.History(path)
    for i in range(40):
        history.record(oscillator(mass=1.0 + i))
    content = bytearray(path.read_bytes())
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(ibs.HistoryError, match="damaged"):
        ibs.History(path)
    path.write_bytes(content[:4096] + os.urandom(4096) + content[8192:])
    with pytest.raises(ibs.HistoryError, match="damaged"):
        ibs.History(path)


WRITER = """
    import sys
    sys.path.insert(0, {root!r})
    import ibsdyn as ibs
    from tests.test_history import oscillator
    history = ibs.History({path!r})
    for i in range({count}):
        print(history.record(oscillator(mass=1.0 + i), revision=f"{{sys.argv[1]}}-{{i}}").name, flush=True)
"""


def start_writer(path, word, count):
    script = textwrap.dedent(WRITER.format(root=ROOT, path=str(path), count=count))
    return subprocess.Popen([sys.executable, "-c", script, word], stdout=subprocess.PIPE, text=True)


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL is POSIX")
def test_killed_writers_lose_nothing_that_was_recorded(tmp_path):
    path = tmp_path / "h.db"
    delays = random.Random(1)
    told = []
    for attempt in range(4):
        writer = start_writer(path, f"writer{attempt}", 10_000)
        assert writer.stdout is not None
        told += writer.stdout.readline().split()
        time.sleep(delays.uniform(0.02, 0.25))
        os.kill(writer.pid, signal.SIGKILL)
        rest = writer.stdout.read()
        told += rest[: rest.rfind("\n") + 1].split()  # the last line may have been cut
        writer.wait()
        writer.stdout.close()
        history = ibs.History(path)
        names = [revision.name for revision in history.revisions]
        assert set(told) <= set(names)
        assert [revision.number for revision in history.revisions] == list(range(1, len(names) + 1))
        for revision in history.revisions:
            (result,) = revision.results
            assert result.value == pytest.approx(hertz(revision.parameters["block.mass"], 5e4), rel=1e-12)
    assert len(told) > 8, "killed in the middle of work, not before it"


def test_two_writers_at_once_lose_nothing(tmp_path):
    path = tmp_path / "h.db"
    writers = [start_writer(path, word, 25) for word in ("left", "right")]
    for writer in writers:
        writer.communicate(timeout=120)
        assert writer.returncode == 0
    revisions = ibs.History(path).revisions
    assert {revision.name for revision in revisions} == {f"{w}-{i}" for w in ("left", "right") for i in range(25)}
    assert [revision.number for revision in revisions] == list(range(1, 51))


def test_a_writer_that_never_ends_is_named(tmp_path, monkeypatch):
    path = tmp_path / "h.db"
    history = ibs.History(path)
    history.record(oscillator())
    monkeypatch.setattr("ibsdyn.history.store.PATIENCE", 0.2)
    blocker = sqlite3.connect(path, isolation_level=None)
    blocker.execute("BEGIN EXCLUSIVE")
    with pytest.raises(ibs.HistoryError, match="another process has been writing"):
        history.record(oscillator(), revision="B")
    blocker.close()
    assert len(history) == 1


def test_figures(tmp_path):
    history = ibs.History(tmp_path / "h.db")
    with pytest.raises(ibs.HistoryError, match="no revision"):
        history.plot()
    history.record(oscillator(2.0, 5e4), revision="A")
    history.record(oscillator(4.0, 5e4), revision="B")
    (panel,) = history.plot()
    labels = panel.get_legend_handles_labels()[1]
    assert labels == ["met", "not met", "limit (at least)"]
    assert [tick.get_text() for tick in panel.get_xticklabels()] == ["A\n1-D", "B\n1-D"]
    np.testing.assert_allclose(panel.lines[0].get_ydata(), [hertz(2.0, 5e4), hertz(4.0, 5e4)])
    assert panel.lines[1].get_ydata()[0] == 20.0
    (panel,) = history.diff("A", "B").plot()
    assert [tick.get_text() for tick in panel.get_yticklabels()] == ["block.mass"]
    (bar,) = panel.patches
    assert bar.get_width() == pytest.approx(hertz(4.0, 5e4) - hertz(2.0, 5e4))
    low, high = panel.get_xlim()
    assert low < hertz(4.0, 5e4) < hertz(2.0, 5e4) < high


def test_what_is_no_model_or_no_text_is_refused(tmp_path):
    history = ibs.History(tmp_path / "h.db")
    with pytest.raises(ibs.HistoryError, match=r"ibs\.Model"):
        history.record("model")
    with pytest.raises(ibs.HistoryError, match="note must be a text"):
        history.record(oscillator(), note=3)
    with pytest.raises(ibs.UnknownKeywordError, match="revision"):
        history.record(oscillator(), revison="B")
    empty = oscillator()
    empty.remove("first mode")
    with pytest.warns(ibs.HistoryWarning, match="no requirements"):
        history.record(empty)
    with pytest.raises(ibs.HistoryError, match="no revision has a requirement"):
        history.plot()


def test_a_path_that_is_none_is_refused():
    with pytest.raises(ibs.HistoryError, match=r"path must be that of a file, as 'module\.history', got 3"):
        ibs.History(3)


def test_names_of_many_revisions_do_not_run_into_each_other(tmp_path):
    model = ibs.Model("one", axis="x")
    model.fixation("floor")
    model.rigid_body("box", mass=1.0)
    model.connection("spring", "floor", "box", stiffness=1e4, zeta=0.01)
    model.add_requirement(ibs.Requirement("first mode", ibs.ModeFrequency(1), 10.0, ">="))
    history = ibs.History(tmp_path / "many.history")
    for number in range(30):
        history.record(model, revision=f"concept {number}")
    (panel,) = history.plot()
    figure = panel.figure
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in panel.get_xticklabels() if text.get_text()]
    assert 3 <= len(boxes) < 30
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))
    assert panel.get_xticklabels()[-1].get_text() == "concept 29\n1-D"
