"""The report: what it says, that it stands alone, and that a real browser draws it."""

import base64
import hashlib
import html.parser
import json
import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fem_import as fi
import ibsdyn as ibs
from fem_import.display import DisplayMesh
from ibsdyn.picture.thinning import crease_edges, thinned
from ibsdyn.reporting.html import number

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
# A name has no dot; nothing else is forbidden.
HOSTILE = "</script><script>document['title']='taken'</script>\u2028<img src=x onerror=alert(1)>&amp;"


def box_on_mount(name="box", names=("block", "mount"), limit=20.0):
    body, mount = names
    model = ibs.Model(name)
    model.fixation("floor", position=(0, 0, 0))
    model.rigid_body(body, mass=2.0, cog=(0, 0, 0.05), inertia=(0.004, 0.005, 0.006, 0, 0, 0))
    model.connection(mount, "floor", body, position1=(0, 0, 0.02), stiffness=(5e4, 6e4, 9e4, 800, 900, 700), zeta=0.02)
    shaking = model.add_input(ibs.BaseMotion("floor", "x", name="shaking"))
    model.add_input(ibs.Force(body, (1, 1, 0), name="push"))
    model.add_sensor(ibs.Sensor(body, "x", position=(0, 0, 0.1), name="top"))
    model.add_sensor(ibs.Sensor(body, "rz", quantity="displacement", name="yaw"))
    model.add_requirement(ibs.Requirement("first mode", ibs.ModeFrequency(1), limit, ">="))
    model.add_requirement(
        ibs.Requirement("amplification", ibs.PeakResponse(shaking, model.sensors["top"], (1, 100)), 5.0)
    )
    model.add_disturbance(ibs.Disturbance("floor noise", shaking, ([1.0, 200.0], [1e-6, 1e-6])))
    return model


def concept():
    model = ibs.Model("concept", axis="x")
    model.fixation("floor")
    model.rigid_body("block", mass=2.0)
    model.connection("mount", "floor", "block", stiffness=5e4, zeta=0.02)
    model.add_input(ibs.BaseMotion("floor", "x", name="shaking"))
    model.add_sensor(ibs.Sensor("block", "x", name="top"))
    model.add_requirement(ibs.Requirement("first mode", ibs.ModeFrequency(1), 20.0, ">="))
    return model


class Page(html.parser.HTMLParser):
    """What a reader of the page sees without its scripts."""

    def __init__(self, path):
        super().__init__(convert_charrefs=True)
        self.source = Path(path).read_text(encoding="utf-8")
        self.tags, self.words, self.data, self.inside = [], [], "", ""
        self.feed(self.source)
        self.data = json.loads(self.data)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self.inside = dict(attributes).get("id", "code") if tag in ("script", "style") else ""

    def handle_endtag(self, tag):
        if tag in ("script", "style"):
            self.inside = ""

    def handle_data(self, data):
        if self.inside == "data":
            self.data += data
        elif not self.inside:
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


def unpacked(packed):
    ((kind, text),) = packed.items()
    return np.frombuffer(base64.b64decode(text), dtype={"f4": "<f4", "i2": "<i2", "u4": "<u4"}[kind])


def test_it_says_what_the_model_predicts(tmp_path):
    model = box_on_mount()
    target = tmp_path / "review.html"
    assert ibs.report(model, target, title="Design review", note="second concept") == target
    page = Page(target)
    system = model.linearize()
    modes = system.modes()
    assert "Design review" in page.text
    assert "second concept" in page.text
    for result in model.check_requirements():
        assert f"{result.value:.4g}" in page.text
    assert "1 of 2" in page.text
    assert "NOT MET" in page.text
    for frequency in modes.frequencies:
        assert number(float(frequency)) in page.text
    for words in ("shaking", "floor noise", "cumulative", "SHA-256", "version of exudyn", "ζ", "mount", "kxx"):
        assert words in page.source
    (budget,) = [b for b in page.data["budget"] if b["name"] == "top"]
    rms = unpacked(budget["curves"][0]["cumulative"])[-1]
    hertz = np.geomspace(1, 200, 200_001)
    response = system.frf(model.inputs["shaking"], model.sensors["top"], hertz).response[0, 0]
    assert rms == pytest.approx(np.sqrt(np.trapezoid(abs(response) ** 2 * 1e-6, hertz)), rel=1e-4)


def test_its_curves_and_shapes_are_the_models_own(tmp_path):
    model = box_on_mount()
    data = Page(ibs.report(model, tmp_path / "r.html", band=(2.0, 150.0))).data
    system = model.linearize()
    assert data["responses"]["inputs"] == ["shaking", "push"]
    for curve in data["responses"]["curves"]:
        frequencies = unpacked(curve["x"]).astype(float)
        assert frequencies[0] == pytest.approx(2.0)
        assert frequencies[-1] == pytest.approx(150.0)
        own = system.frf(
            list(model.inputs.values())[curve["input"]], list(model.sensors.values())[curve["output"]], frequencies
        ).response[0, 0]
        np.testing.assert_allclose(unpacked(curve["magnitude"]), abs(own), rtol=1e-3, atol=1e-6 * abs(own).max())
    scene = data["scene"]
    block = next(part for part in scene["parts"] if part["name"] == "block")
    corners = unpacked(scene["positions"]).reshape(-1, 3)[block["points"][0] :][: block["points"][1]] + scene["centre"]
    np.testing.assert_allclose(corners.mean(axis=0), (0, 0, 0.05), atol=1e-6)
    # a box of its mass and inertia: m/12 (b² + c²)
    sides = np.ptp(corners, axis=0)
    np.testing.assert_allclose(2.0 / 12 * np.array([s @ s for s in (sides[[1, 2]], sides[[0, 2]], sides[[0, 1]])]),
                               (0.004, 0.005, 0.006), rtol=1e-5)  # fmt: skip
    modes = system.modes()
    for number_, mode in enumerate(scene["modes"]):
        motion = mode["unit"] * unpacked(mode["motion"]).reshape(-1, 3)[block["points"][0] :][: block["points"][1]]
        shape = modes.shapes[:6, number_]
        expected = shape[:3] + np.cross(shape[3:], corners - (0, 0, 0.05))
        scale = np.sum(motion * expected) / np.sum(expected**2)
        np.testing.assert_allclose(motion, scale * expected, atol=2e-4 * scene["size"] * 0.1)
    largest = max(np.linalg.norm(mode["unit"] * unpacked(mode["motion"]).reshape(-1, 3), axis=1).max()
                  for mode in scene["modes"])  # fmt: skip
    assert largest == pytest.approx(0.1 * scene["size"], rel=1e-3)


def test_fidelities_stand_beside_each_other(tmp_path):
    page = Page(ibs.report(box_on_mount(), tmp_path / "r.html", fidelities=[concept(), box_on_mount()]))
    labels = {curve["label"] for curve in page.data["responses"]["curves"]}
    assert labels == {"box (3-D)", "concept", "box (3-D) ′"}
    assert "concept does not have" in page.text, "what a 1-D model cannot answer is said, not left out"
    assert "By fidelity" in page.text
    drawn = Page(ibs.report(concept(), tmp_path / "c.html")).data
    assert drawn["scene"]["schematic"]
    assert [part["name"] for part in drawn["scene"]["parts"]] == ["block", "mount", "floor"]


def test_a_test_and_a_history_are_shown(tmp_path):
    model = box_on_mount()
    history = ibs.History(tmp_path / "h.db")
    history.record(concept(), revision="A")
    history.record(model, revision="B", note="mount as bought")
    system = model.linearize()
    hertz = np.geomspace(5, 100, 200)
    own = system.frf(model.inputs["shaking"], model.sensors["top"], hertz)
    softer = model.with_parameters({"mount.kx": 4.5e4}).linearize()
    comparison = ibs.compare(own, softer.frf(model.inputs["shaking"], model.sensors["top"], hertz))
    page = Page(ibs.report(model, tmp_path / "r.html", comparison=comparison, history=history))
    for words in ("Model against test", "FRAC", "Resonances", "mount as bought", "History", "1 of 2 met"):
        assert words in page.text, words
    assert {curve["label"] for curve in page.data["comparison"]["curves"]} == {"model", "test"}
    first = next(panel for panel in page.data["history"] if panel["name"] == "first mode")
    assert first["limits"] == [[-0.5, 1.5, 20.0]]
    assert first["y"] == [r.result("first mode").value for r in history.revisions]


def test_a_study_is_shown(tmp_path):
    model = box_on_mount()
    tolerances = [ibs.Tolerance("block.mass", plus_minus=0.3), ibs.Tolerance("mount.kz", sigma=0.05, relative=True)]
    limit = float(np.median(ibs.Study(model, ibs.monte_carlo(model, tolerances, 60)).run(workers=1)[0]))
    model.remove("first mode")
    model.add_requirement(ibs.Requirement("first mode", ibs.ModeFrequency(1), limit, ">="))
    results = ibs.Study(model, ibs.monte_carlo(model, tolerances, 60)).run(workers=1)
    page = Page(ibs.report(model, tmp_path / "r.html", study=results))
    (first,) = (odds for odds in results.odds() if odds.requirement == "first mode")
    words = ("Tolerances", f"{number(100 * first.share)} %", f"{first.met} of 60", "block.mass −", "far to the")
    for each in (*words, number(float(results.values[:, 0].mean()))):
        assert each in page.text, each
    bars = re.findall(r'<rect x="[\d.]+" y="[\d.]+" width="[\d.]+" height="([\d.]+)"/>', page.source)
    assert len(bars) == 2 * 9
    assert 'class="limit"' in page.source
    sweep = ibs.Study(model, ibs.full_factorial({"block.mass": [1.0, 2.0, 8.0]})).run(workers=1)
    page = Page(ibs.report(model, tmp_path / "s.html", study=sweep))
    for value in sweep.values[:, 0]:
        assert number(float(value)) + (" ✗" if value < limit else "") in page.text
    with pytest.raises(ibs.ReportError, match="another model"):
        ibs.report(concept(), tmp_path / "t.html", study=sweep)
    with pytest.raises(ibs.ReportError, match=r"ibs\.StudyResults"):
        ibs.report(model, tmp_path / "t.html", study=sweep.study)


def test_the_region_of_a_test_is_drawn(tmp_path):
    rng = np.random.default_rng(1)
    shaking = rng.normal(size=20_000)
    top = 2.0 * shaking + 0.1 * rng.normal(size=20_000)
    record = ibs.TimeRecord([shaking, top], ["shaking", "top"], ["m/s²", "m/s²"], 1000.0)
    estimate = ibs.estimate_frf(record, inputs=["shaking"], outputs=["top"], method="welch")
    model = ibs.FrequencyResponse(
        estimate.frequencies, np.full(estimate.response.shape, 2.0 + 0j), ("top",), ("shaking",), ("m/s²",), ("m/s²",)
    )
    page = Page(ibs.report(concept(), tmp_path / "r.html", comparison=ibs.compare(model, estimate)))
    test = next(curve for curve in page.data["comparison"]["curves"] if curve["label"] == "test")
    low, high = unpacked(test["low"]), unpacked(test["high"])
    np.testing.assert_allclose(0.5 * (high - low), estimate.radius(0.99)[0, 0], rtol=1e-3)
    assert 0.97 < np.mean((low < 2) & (high > 2)) <= 1, "the truth is inside"
    assert "99 % region" in page.text


def test_half_a_character_in_a_name_is_no_reason_to_fail(tmp_path):
    assert "a?b" in Page(ibs.report(concept(), tmp_path / "r.html", title="a\ud800b")).text


def test_a_model_without_signals_or_requirements_says_how_to_add_them(tmp_path):
    model = ibs.Model("bare")
    model.rigid_body("block", mass=2.0, cog=(0, 0, 0.05), inertia=(0.004, 0.005, 0.006, 0, 0, 0))
    page = Page(ibs.report(model, tmp_path / "r.html"))
    assert "model.add_requirement" in page.text
    assert "model.add_input" in page.text
    assert "rigid-body motion" in page.text
    assert page.data["responses"] is None


def test_it_stands_alone_and_hostile_names_stay_names(tmp_path):
    model = box_on_mount(name=HOSTILE, names=(HOSTILE, "mount"))
    history = ibs.History(tmp_path / "h.db")
    history.record(model, note=HOSTILE, revision=HOSTILE)
    page = Page(ibs.report(model, tmp_path / "r.html", note=HOSTILE, history=history))
    assert [tag for tag, _ in page.tags].count("script") == 2
    assert not {"img", "link", "iframe", "object", "base"} & {tag for tag, _ in page.tags}
    for _, attributes in page.tags:
        assert not [name for name in attributes if name in ("src", "onclick", "onload", "onerror")]
        assert attributes.get("href", "#").startswith("#")
    # the only address in it is a name space, which no browser loads
    assert set(re.findall(r"https?://[^\s\"'<)]*", page.source)) == {"http://www.w3.org/2000/svg"}
    assert not re.search(r"@import|url\(\s*['\"]?(?!#)", page.source)
    code = page.source.rsplit("<script>", 1)[1].split("</script>")[0]
    digest = base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()
    policy = next(a["content"] for t, a in page.tags if t == "meta" and a.get("http-equiv"))
    assert policy == f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    assert " ".join(HOSTILE.split()) in page.text, "and it is told as it was given"
    assert any(part["name"] == HOSTILE for part in page.data["scene"]["parts"])


def test_the_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    target = tmp_path / "r.html"
    ibs.report(concept(), target)
    before = target.read_bytes()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(ibs.ReportError, match="No space left"):
        ibs.report(concept(), target, title="another")
    assert target.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"], "no temporary file stays"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"path": "nowhere/r.html"}, "does not exist"),
        ({"path": "."}, "is a folder"),
        ({"path": 3}, "path must be"),
        ({"modes": 0}, "modes="),
        ({"history": "h.db"}, r"ibs\.History"),
        ({"fidelities": ["concept"]}, r"ibs\.Model"),
        ({"title": 4}, "title="),
        ({"band": (5.0,)}, "band"),
    ],
)
def test_wrong_arguments_are_refused(tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises((ibs.ReportError, ibs.AnalysisError), match=words):
        ibs.report(concept(), **{"path": "r.html", **arguments})


def test_figures_are_written_as_people_read_them():
    assert [number(v) for v in (265.8112, 0.0, -1.5e-7, 123456.0, 1e-4, 4e8, float("inf"), float("nan"))] == [
        "265.8", "0", "−1.5·10⁻⁷", "1.235·10⁵", "0.0001", "4·10⁸", "∞", "–",
    ]  # fmt: skip


def sphere(rings):
    """A closed mesh of triangles with outward faces."""
    theta, phi = np.linspace(0.02, np.pi - 0.02, rings), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    points = np.array([[np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)] for t in theta for p in phi])
    n, triangles = len(phi), []
    for i in range(rings - 1):
        for j in range(n):
            a, b, c, d = i * n + j, i * n + (j + 1) % n, (i + 1) * n + j, (i + 1) * n + (j + 1) % n
            triangles += [(a, c, b), (b, c, d)]
    return points, np.array(triangles)


def test_fine_meshes_and_many_responses_stay_small(tmp_path):
    points, triangles = sphere(99)
    n = 12
    motion = np.zeros((len(points), 3, n))
    motion[:, :, :3] = np.eye(3)  # interface "a" carries the skin along
    K = np.kron([[1, -1], [-1, 1]], np.diag([1e6] * 3 + [1e3] * 3))
    body = fi.ReducedBody.from_arrays(np.diag([0.5] * 3 + [1e-3] * 3 + [0.5] * 3 + [1e-3] * 3), K,
                                      {"a": (0, 0, 0), "b": (0, 0, 0)})  # fmt: skip
    model = ibs.Model("fine")
    model.fixation("floor", position=(0, 0, -1))
    model.flexible_body("ball", replace(body, display=DisplayMesh(points, triangles, motion.reshape(-1, n))))
    model.connection("foot", "floor", "ball.a", position1=(0, 0, -1), stiffness=(1e6,) * 3 + (1e5,) * 3, zeta=0.01)
    for i, direction in enumerate(("x", "y", "z", "rx", "ry", "rz")):
        model.add_sensor(ibs.Sensor("ball.b", direction, name=f"sensor {i}"))
        model.add_input(ibs.BaseMotion("floor", direction, name=f"shaker {i}"))
    path = ibs.report(model, tmp_path / "r.html", fidelities=[model.copy("twin"), model.copy("triplet")], modes=100)
    assert len(points) > 19_000
    assert path.stat().st_size < 5e6
    data = Page(path).data
    assert len(data["responses"]["curves"]) == 3 * 36
    ball = data["scene"]["parts"][0]
    assert 3000 < ball["points"][1] <= 6000


def test_a_fine_mesh_is_thinned_and_keeps_its_shape():
    points, triangles = sphere(60)
    mesh = DisplayMesh(points, triangles, np.eye(3 * len(points), 4))
    few, faces, kept = thinned(mesh, 500)
    assert 250 < len(few) <= 500
    np.testing.assert_array_equal(few, points[kept])
    assert len(np.unique(faces)) > 0.9 * len(few)
    np.testing.assert_allclose(np.ptp(few, axis=0), 2.0, atol=0.2)
    area = 0.5 * np.linalg.norm(
        np.cross(few[faces[:, 1]] - few[faces[:, 0]], few[faces[:, 2]] - few[faces[:, 0]]), axis=1
    )
    assert area.sum() == pytest.approx(4 * np.pi, rel=0.1)
    same, _, everything = thinned(mesh, len(points))
    assert same is mesh.points
    assert len(everything) == len(points)


def test_edges_are_drawn_where_faces_meet_at_an_angle():
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    quads = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    cube = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    edges = crease_edges(corners, cube)
    assert len(edges) == 12, "the edges of the cube and no diagonal"
    np.testing.assert_allclose(np.linalg.norm(corners[edges[:, 0]] - corners[edges[:, 1]], axis=1), 1.0)
    assert len(crease_edges(corners, cube[:1])) == 3, "a face that ends has an outline"


# --- a real browser

# Acts as a reader of the page and writes what came of it into the document, which --dump-dom prints.
DRIVER = (Path(__file__).parent / "report_driver.js").read_text(encoding="utf-8")


def driven(path, tmp_path, *flags):
    """Open a copy of the report that drives itself, and return what it saw."""
    source = Path(path).read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(DRIVER.encode()).digest()).decode()
    source = source.replace("script-src '", f"script-src 'sha256-{digest}' '", 1)
    source = source.replace("</body>", f"<script>{DRIVER}</script></body>")
    copy = tmp_path / "driven.html"
    copy.write_text(source, encoding="utf-8")
    with tempfile.TemporaryDirectory() as profile:
        run = subprocess.run(
            [
                CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                "--disable-background-networking", "--disable-component-update", "--disable-sync",
                f"--user-data-dir={profile}", "--window-size=1280,800", "--virtual-time-budget=4000", "--dump-dom",
                *flags, copy.as_uri(),
            ],
            capture_output=True, text=True, timeout=120, check=True,
        )  # fmt: skip
    failure = re.search(r'<html[^>]*data-failure="([^"]*)"', run.stdout)
    assert failure is None, failure.group(1)
    found = re.search(r'<html[^>]*data-found="([^"]*)"', run.stdout)
    assert found, run.stdout[:500] + run.stderr[-500:]
    return json.loads(html.unescape(found.group(1)))


browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium here (apt-get install chromium)")


@browser
@pytest.mark.parametrize(("painter", "flags"), [("webgl", ()), ("canvas", ("--disable-3d-apis",))])
def test_a_browser_draws_it(tmp_path, painter, flags):
    model = box_on_mount(names=(HOSTILE, "mount"))
    history = ibs.History(tmp_path / "h.db")
    history.record(model)
    path = ibs.report(model, tmp_path / "r.html", title="Review", fidelities=[concept()], history=history)
    found = driven(path, tmp_path, *flags)
    assert found["title"] == "Review"
    assert found["ready"] == "yes"
    if painter == "canvas":
        assert found["painter"] == "canvas"
    for picture in ("before", "paper", "turned", "first", "third"):
        assert 0.01 < found[picture]["share"] < 0.9, picture
    assert found["turned"]["sum"] != found["before"]["sum"], "it turns"
    assert found["first"]["sum"] != found["third"]["sum"], "another mode, another shape"
    frequencies = model.linearize().modes().frequencies
    assert found["modes"] == len(frequencies)
    assert number(float(frequencies[2])) in found["heading"]
    assert found["bars"]
    assert len(found["curves"]) == 4, "magnitude and phase of two fidelities"
    assert min(found["curves"]) > 1000
    assert len(found["other"]) == 2, "the 1-D model has no push"
    assert found["caption"] == "From push to top", "what paper shows in place of the controls"
    assert "Hz" in found["hint"]
    assert found["charts"] == 1 + 2 + 2, "responses, a budget a sensor, a history a requirement"
    assert found["wide"] == 0, "nothing sticks out of the page"


def test_a_missed_requirement_is_named_beside_the_count_and_margins_are_plain_figures(tmp_path):
    model = box_on_mount()
    model.add_requirement(ibs.Requirement("far away", ibs.ModeFrequency(1), 1.0, "<="))
    page = Page(ibs.report(model, tmp_path / "r.html"))
    assert "1 of 3 requirements met; not met: amplification, far away" in page.text
    margin = 100 * (1.0 - model.linearize().modes().frequencies[0])
    assert margin < -1000
    assert f"−{float(f'{-margin:.3g}'):g} %" in page.text
    assert not re.search(r"\de[+-]\d", page.text)


def test_signals_are_told_in_words_and_not_in_class_names(tmp_path):
    page = Page(ibs.report(box_on_mount(), tmp_path / "r.html"))
    assert "base motion, acceleration" in page.text
    assert "BaseMotion" not in page.text


@pytest.mark.parametrize(("share", "drawn"), [(0.5, True), (3.0, True), (50.0, False)])
def test_the_limit_of_an_rms_stands_in_the_chart_of_its_budget(tmp_path, share, drawn):
    model = box_on_mount()
    asked = ibs.RmsResponse(model.sensors["top"], model.disturbances["floor noise"])
    limit = share * asked.evaluate(model.linearize())
    model.add_requirement(ibs.Requirement("quiet", asked, limit))
    narrow = ibs.RmsResponse(model.sensors["top"], model.disturbances["floor noise"], (1.0, 20.0))
    model.add_requirement(ibs.Requirement("another band, another curve", narrow, limit))
    by_name = {
        budget["name"]: budget["limits"] for budget in Page(ibs.report(model, tmp_path / "r.html")).data["budget"]
    }
    assert [each["y"] for each in by_name["top"]] == ([limit] if drawn else [])
    assert by_name["yaw"] == []


def test_the_page_tells_which_revision_its_model_is(tmp_path):
    model, history = box_on_mount(), ibs.History(tmp_path / "box.history")
    history.record(model, revision="A")
    words = [Page(ibs.report(model, tmp_path / "r.html", history=history)).text]
    history.record(model.with_parameters({"block.mass": 3.0}), revision="B")
    words.append(Page(ibs.report(model, tmp_path / "r.html", history=history)).text)
    words.append(
        Page(ibs.report(model.with_parameters({"block.mass": 4.0}), tmp_path / "r.html", history=history)).text
    )
    assert "is the last revision, A." in words[0]
    assert "is revision A, not the last one, B." in words[1]
    assert "is none of these revisions" in words[2]


def test_of_a_free_system_rigid_motion_is_one_and_modes_of_requirements_are_told(tmp_path):
    model = ibs.Model("free")
    for name, x in (("left", 0.0), ("right", 0.1)):
        model.rigid_body(name, mass=1.0, cog=(x, 0, 0), inertia=(0.01, 0.01, 0.01, 0, 0, 0))
    model.connection(
        "rod", "left", "right", position1=(0.05, 0, 0), stiffness=(1e6, 2e6, 3e6, 1e3, 2e3, 3e3), zeta=0.01
    )
    push = model.add_input(ibs.Force("left", "x", name="push"))
    model.add_sensor(ibs.Sensor("right", "x", name="end"))
    model.add_disturbance(ibs.Disturbance("noise", push, ([1.0, 10.0], [1.0, 1.0])))
    page = Page(ibs.report(model, tmp_path / "r.html"))
    assert "their mode 1 is mode 7 here" in page.text
    assert "(0 Hz)" not in page.text
    # far below the resonance both masses accelerate as one: F / (2 m)
    shares = ibs.vibration_budget(model.linearize(), model.sensors["end"], model.disturbances["noise"]).shares("mode")
    assert shares["rigid-body motion"] == pytest.approx(1.0, rel=1e-3)
    assert sum(shares.values()) == pytest.approx(1.0, rel=1e-9)
