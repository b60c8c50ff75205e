"""Model files: what is written is read back to the last digit, and nothing hostile does harm."""

import contextlib
import math
import os
import stat
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import fem_import as fi
import ibsdyn as ibs

ROOT = Path(__file__).parents[1]
# Every example of a property writes into the same folder, on purpose.
RELAXED = (HealthCheck.function_scoped_fixture, HealthCheck.too_slow)
EXPORT = ROOT / "examples" / "mirror_flexure"

TABLE_1 = """
[model]
name = "mirror module"

[parameters]
E = 113e9
width = 0.035
thickness = 3e-4
length = 0.02
I = "width*thickness^3/12"

[fixation.platform]
position = [0, 0, 0]

[rigid_body.mirror]
mass = 0.25
cog = [0, 0, 0.08]
inertia = [1e-4, 1e-4, "2 * 1e-4", 0, 0, 0]

[connection.mount]
between = ["platform", "mirror"]
position1 = [0, 0, 0.05]
position2 = [0, 0, "0.05 + length"]
stiffness = [1e7, "12*E*I/length^3", inf, 1e3, 1e3, 1e3]
zeta = 0.01

[input.shake]
type = "base_motion"
item = "platform"
direction = "x"

[sensor.Y1]
item = "mirror"
direction = "x"
position = [0, 0, 0.1]

[requirement."first mode"]
quantity = "mode_frequency"
mode = 1
sense = ">="
limit = 30
"""


@pytest.fixture
def write(tmp_path):
    def written(text, name="mirror.toml"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
        return path

    return written


def body(k=1e6):
    M, K = np.eye(14) * 0.1, np.zeros((14, 14))
    K[:3, :3] = K[6:9, 6:9] = k * np.eye(3)
    K[:3, 6:9] = K[6:9, :3] = -k * np.eye(3)
    K[12, 12], K[13, 13] = 1e9, math.pi * 1e9
    return fi.ReducedBody.from_arrays(M, K, {"base": (0, 0, 0), "tip": (0, 0, 0.02)}, source="hand")


# -- Table 1 of the paper


def test_table_1_becomes_the_model_that_python_makes(write):
    model = ibs.Model.from_toml(write(TABLE_1))
    by_hand = ibs.Model("mirror module")
    by_hand.fixation("platform")
    by_hand.rigid_body("mirror", mass=0.25, cog=(0, 0, 0.08), inertia=(1e-4, 1e-4, 2e-4, 0, 0, 0))
    inertia = 0.035 * 3e-4**3.0 / 12
    by_hand.connection(
        "mount",
        "platform",
        "mirror",
        position1=(0, 0, 0.05),
        position2=(0, 0, 0.05 + 0.02),
        stiffness=(1e7, 12 * 113e9 * inertia / 0.02**3.0, math.inf, 1e3, 1e3, 1e3),
        zeta=0.01,
    )
    by_hand.add_input(ibs.BaseMotion("platform", "x", name="shake"))
    by_hand.add_sensor(ibs.Sensor("mirror", "x", position=(0, 0, 0.1), name="Y1"))
    by_hand.add_requirement(ibs.Requirement("first mode", ibs.ModeFrequency(1), 30, sense=">="))
    assert model == by_hand
    assert model.check() == []
    (result,) = model.check_requirements()
    assert result.value == by_hand.linearize().modes().frequencies[0]


def test_a_one_dimensional_concept(write):
    text = """
    [model]
    axis = "rz"
    [fixation.frame]
    [rigid_body.mirror]
    inertia = 2e-4
    [connection.flexure]
    between = ["frame", "mirror"]
    stiffness = 500
    """
    model = ibs.Model.from_toml(write(text, "concept.toml"))
    assert model.name == "concept"
    assert model.linearize().modes().frequencies[0] == pytest.approx(math.sqrt(500 / 2e-4) / (2 * math.pi))


def test_products_of_inertia_as_cad_prints_them(write):
    text = TABLE_1.replace('"2 * 1e-4", 0, 0, 0]', '2e-4, 1e-5, 0, 0]\nproducts = "integral"')
    assert ibs.Model.from_toml(write(text)).items["mirror"].inertia[3] == -1e-5


def test_a_flexible_body_out_of_an_export_is_the_one_that_python_reduces(write, tmp_path):
    for name in os.listdir(EXPORT):
        (tmp_path / name).write_bytes((EXPORT / name).read_bytes())
    text = """
    [flexible_body.flexure]
    export = "flexure.inp"
    max_frequency = "2 * 2000"
    zeta = 0.002
    cache = "reduced"
    [flexible_body.flexure.interfaces]
    base = "BASE"
    tip = { nodes = "TIP", tie = "average" }
    """
    path = write(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ExportWarning)
        read = ibs.Model.from_toml(path).items["flexure"]
        part = fi.read_calculix(tmp_path / "flexure.inp")
        own = fi.reduce(part, {"base": "BASE", "tip": fi.Interface("TIP", tie="average")}, max_frequency=4000.0)
    assert read.zeta == 0.002
    assert read.reduced.interfaces["tip"].tie == "average"
    np.testing.assert_allclose(read.reduced.frequencies, own.frequencies, rtol=1e-9)
    assert list((tmp_path / "reduced").glob("*.npz"))


# -- disturbances


def test_disturbances_as_python_makes_them(write, tmp_path):
    (tmp_path / "floor.csv").write_text("frequency;PSD\n1;1e-3\n10;2,5e-4\n", encoding="utf-8")
    text = (
        TABLE_1
        + """
    [disturbance.floor]
    input = "shake"
    psd = { file = "floor.csv" }
    [disturbance.lab]
    input = "shake"
    psd = { criterion = "VC-C" }
    [disturbance.launch]
    input = "shake"
    psd = { spectrum = "GEVS acceptance" }
    [disturbance.hiss]
    input = { name = "hiss force", type = "force", item = "mirror", direction = "z" }
    psd = { white = "1e-6", band = [1, 100] }
    [disturbance.pump]
    type = "tone"
    input = "shake"
    amplitude = 0.01
    frequency = "2900/60"
    [disturbance.both]
    type = "correlated"
    inputs = ["shake", { name = "tilt", type = "base_motion", item = "platform", direction = "ry" }]
    correlation = [[1, 0.5], [0.5, 1]]
    psds = [
        { frequencies = [1, 10], values = [1, 2] },
        { frequencies = [1, 10], values = [3, 4], unit = "rad/s²", title = "tilt" },
    ]
    [requirement.jitter]
    quantity = "rms_response"
    output = "Y1"
    disturbances = ["floor", "pump"]
    limit = 0.1
    """
    )
    model = ibs.Model.from_toml(write(text))
    shake = model.inputs["shake"]
    tilt = ibs.BaseMotion("platform", "ry", name="tilt")
    floor = ibs.Disturbance("floor", shake, ibs.PSD((1, 10), (1e-3, 2.5e-4), "m/s²", "floor"))
    pump = ibs.Tone("pump", shake, 0.01, 2900 / 60)
    hiss = ibs.Force("mirror", "z", name="hiss force")
    assert list(model.disturbances.values()) == [
        floor,
        ibs.Disturbance("lab", shake, ibs.floor_vibration("VC-C")),
        ibs.Disturbance("launch", shake, ibs.launch_vibration("GEVS acceptance")),
        ibs.Disturbance("hiss", hiss, ibs.PSD.white(1e-6, (1, 100), "N")),
        pump,
        ibs.CorrelatedDisturbance(
            "both",
            [shake, tilt],
            [ibs.PSD((1, 10), (1, 2)), ibs.PSD((1, 10), (3, 4), "rad/s²", "tilt")],
            [[1, 0.5], [0.5, 1]],
        ),
    ]
    assert model.requirements["jitter"].quantity == ibs.RmsResponse(model.sensors["Y1"], [floor, pump])
    model.to_toml(tmp_path / "written.toml")
    assert ibs.Model.from_toml(tmp_path / "written.toml") == model
    assert model.check() == []


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ('input = "shak"\npsd = {criterion = "VC-A"}', r"input: 'shak' is not in the file\. Did you mean 'shake'"),
        ('input = "shake"', r"psd: is missing"),
        ('input = "shake"\npsd = {criterion = "VC-Z"}', r"'VC-Z' is not known"),
        ('input = "shake"\npsd = {criterion = "VC-A", file = "a"}', r"psd psd: needs one of values, .*got \['file', "),
        ('input = "shake"\npsd = {values = [1, 2], frequncies = [1, 2]}', r"frequncies: unknown key\. Did you mean"),
        ('input = "shake"\npsd = {values = [1, 2]}', r"0 frequencies and 2 values"),
        ('input = "shake"\npsd = {file = "../a.csv"}', r"leads out of the folder"),
        ('input = "shake"\npsd = {file = "gone.csv"}', r"gone\.csv"),
        ('input = "shake"\npsd = {white = 1, band = [0, 1]}', r"band must be two rising frequencies"),
        ('type = "correlated"\ninputs = "shake"', r"inputs: must be a list with an entry for each input, got 'shake'"),
        ('type = "correlated"\ninputs = ["shake"]\npsds = [1, 2]', r"psds: are 2 for 1 inputs"),
        ('type = "correlated"\ninputs = ["shake"]\npsds = [1]', r"psds: must be a table of keys and values, got 1"),
        ('type = "tone"\ninput = "shake"\nfrequency = 3', r"amplitude"),
        ('type = "tones"', r"type: 'tones' is not known\. Did you mean 'tone'"),
    ],
)
def test_disturbances_that_cannot_be(write, values, words):
    with pytest.raises(ibs.ModelFileError, match=r"mirror\.toml: \[disturbance\.d\].*" + words):
        ibs.Model.from_toml(write(TABLE_1 + f"[disturbance.d]\n{values}\n"))


def test_a_requirement_on_a_disturbance_that_the_model_lacks_is_refused(tmp_path):
    model = ibs.Model("m")
    noise = ibs.Disturbance("noise", ibs.Force("a", "x"), ibs.PSD.white(1.0, (1.0, 2.0), "N"))
    model.add_requirement(ibs.Requirement("quiet", ibs.RmsResponse(ibs.Sensor("a", "x"), noise), 1.0))
    with pytest.raises(ibs.ModelFileError, match="'noise' is not in the model; add it by add_disturbance"):
        model.to_toml(tmp_path / "m.toml")


# -- exact round trip

finite = st.floats(-1e6, 1e6, allow_nan=False)
positive = st.floats(1e-9, 1e9)
names = st.text(min_size=1, max_size=8).filter(lambda s: s == s.strip() and "." not in s and _is_utf8(s))
points = st.tuples(finite, finite, finite)
stiffnesses = st.one_of(st.floats(0, 1e12), st.just(math.inf))


def _is_utf8(text):
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


@st.composite
def models(draw):
    model = ibs.Model(draw(names))
    unique = iter(draw(st.lists(names, min_size=18, max_size=18, unique=True)))
    items = []
    for kind in draw(st.permutations(["fixation", "rigid", "rigid", "flexible"])):
        name = next(unique)
        if kind == "fixation":
            model.fixation(name, draw(points))
            items.append(name)
        elif kind == "rigid":
            a, b, c = (draw(st.floats(1e-6, 1e3)) for _ in range(3))
            model.rigid_body(name, draw(positive), draw(points), (a + b, b + c, c + a, 0, draw(st.just(1e-9)), 0))
            items.append(name)
        else:
            model.flexible_body(name, body(draw(st.floats(1.0, 1e7))), draw(st.floats(0, 0.2)))
            items += [f"{name}.base", f"{name}.tip"]
    turn = np.linalg.qr(np.array(draw(st.lists(finite, min_size=9, max_size=9))).reshape(3, 3))[0]
    for _ in range(2):
        one, two = draw(st.permutations(items))[:2]
        model.connection(
            next(unique),
            one,
            two,
            position1=draw(points),
            position2=draw(points),
            stiffness=draw(st.tuples(*[stiffnesses] * 6)),
            zeta=draw(st.floats(0, 0.2)),
            axes=turn * np.sign(np.linalg.det(turn)),
            damping=draw(st.none() | st.tuples(*[st.floats(0, 1e6)] * 6)),
            elastic_centre=draw(st.none() | points),
        )
    direction = draw(st.sampled_from(["x", "y", "z"]) | points.filter(lambda p: math.hypot(*p) > 1e-6))
    push = model.add_input(ibs.Force(items[0], direction, position=draw(st.none() | points)))
    model.add_input(ibs.BaseMotion(items[1], "rx", quantity="velocity", name=next(unique)))
    model.add_input(ibs.Torque(items[2], "rz", name=next(unique)))
    seen = model.add_sensor(
        ibs.Sensor(items[0], direction, draw(st.none() | points), "displacement", next(unique), items[1])
    )
    model.add_requirement(ibs.Requirement(next(unique), ibs.ResponseAt(push, seen, draw(positive)), draw(positive)))
    other = ibs.Sensor(items[2], "rz")
    model.add_requirement(
        ibs.Requirement(next(unique), ibs.PeakResponse(push, other, (0.1, 7.0), name=draw(st.none() | names)), 1.0)
    )
    model.add_input(ibs.Stroke(next(iter(model.connections)), "rx"))
    other = ibs.Sensor(items[2], "z", quantity="displacement")
    model.add_sensor(ibs.CombinedSensor(next(unique), [(1.0, seen), (draw(finite), other)], "m"))
    psd = ibs.PSD((1.0, 2.0, 2.0, draw(st.floats(3, 1e4))), draw(st.tuples(*[positive] * 4)), "N", draw(names))
    noise = model.add_disturbance(ibs.Disturbance(next(unique), push, psd))
    own = ibs.Force(items[1], "y")
    model.add_disturbance(
        ibs.CorrelatedDisturbance(next(unique), [push, own], [psd, psd], [[1, 0.3 + 0.4j], [0.3 - 0.4j, 1]])
    )
    pump = model.add_disturbance(ibs.Tone(next(unique), own, draw(positive), draw(positive)))
    band = draw(st.none() | st.just((1.0, 5.0)))
    rms = ibs.RmsResponse(seen, draw(st.sampled_from([noise, [noise, pump]])), band)
    model.add_requirement(ibs.Requirement(next(unique), rms, draw(positive)))
    model.add_requirement(ibs.Requirement(next(unique), ibs.ModeDamping(2), draw(positive), sense=">="))
    return model


@given(models())
@settings(max_examples=40, deadline=None, suppress_health_check=RELAXED)
def test_what_is_written_is_read_back_to_the_last_digit(tmp_path, model):
    path, again = tmp_path / "any.toml", tmp_path / "again.toml"
    for file in (path, again):
        file.unlink(missing_ok=True)
    model.to_toml(path)
    back = ibs.Model.from_toml(path)
    assert back == model
    assert list(back.items) == list(model.items)
    back.to_toml(again)
    assert again.read_bytes() == path.read_bytes()


def test_a_one_dimensional_model_round_trips(tmp_path):
    for axis in ("x", "rz"):
        model = ibs.Model("concept", axis=axis)
        model.rigid_body("mirror", **{"mass" if axis == "x" else "inertia": 1 / 3})
        model.fixation("frame")
        model.connection("k", "mirror", "frame", stiffness=math.inf)
        model.connection("c", "mirror", "frame", stiffness=0.1, damping=0.3)
        model.to_toml(tmp_path / "m.toml")
        assert ibs.Model.from_toml(tmp_path / "m.toml") == model


def test_two_models_in_one_folder_keep_their_own_bodies(tmp_path):
    first, second = ibs.Model("v1"), ibs.Model("v2")
    first.flexible_body("flexure", body(1e6))
    second.flexible_body("flexure", body(2e6))
    first.to_toml(tmp_path / "v1.toml")
    second.to_toml(tmp_path / "v2.toml")
    first.to_toml(tmp_path / "v1 again.toml")
    assert ibs.Model.from_toml(tmp_path / "v1.toml") == first
    assert ibs.Model.from_toml(tmp_path / "v2.toml") == second
    assert len(list(tmp_path.glob("*.npz"))) == 2


def test_a_damaged_body_beside_the_file_is_written_anew(tmp_path):
    model = ibs.Model("m")
    model.flexible_body("flexure", body())
    model.to_toml(tmp_path / "m.toml")
    (npz,) = tmp_path.glob("*.npz")
    npz.write_bytes(b"gone")
    with pytest.raises(ibs.ModelFileError, match=r"m\.toml: \[flexible_body\.flexure\] .*damaged"):
        ibs.Model.from_toml(tmp_path / "m.toml")
    model.to_toml(tmp_path / "m.toml")
    assert ibs.Model.from_toml(tmp_path / "m.toml") == model


def test_files_are_written_whole_or_not_at_all(tmp_path, monkeypatch):
    model = ibs.Model("m")
    model.fixation("floor")
    path = tmp_path / "m.toml"
    model.to_toml(path)
    before = path.read_bytes()
    path.chmod(0o640)
    model.fixation("wall")

    def breaks(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", breaks)
        with pytest.raises(ibs.ModelFileError, match=r"m\.toml cannot be written: No space left"):
            model.to_toml(path)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["m.toml"]
    model.to_toml(path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    with pytest.raises(ibs.ModelFileError, match="cannot be written"):
        model.to_toml(tmp_path / "nowhere" / "m.toml")


def test_a_quantity_of_the_users_own_is_refused_in_words(tmp_path):
    class Cost:
        name, unit = "cost", "EUR"

        def evaluate(self, system):
            return 1.0

    model = ibs.Model("m")
    model.add_requirement(ibs.Requirement("cheap", Cost(), 2.0))
    with pytest.raises(ibs.ModelFileError, match="'cheap': its quantity is a Cost, which model files do not know"):
        model.to_toml(tmp_path / "m.toml")
    assert not os.listdir(tmp_path)


# -- what is wrong is said with file, table, key, value and the nearest known key


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "stiffness =",
            "stifness =",
            r"mirror\.toml: \[connection\.mount\] stifness: unknown key\. Did you mean 'stiffness'\?",
        ),
        (
            "[rigid_body.mirror]",
            "[rigid_bodies.mirror]",
            r"mirror\.toml: \[rigid_bodies\] unknown table\. Did you mean 'rigid_body'\?",
        ),
        ("mass = 0.25", 'mass = "0,25"', r"\[rigid_body\.mirror\] mass: '0,25': ',' is not part .* point"),
        ("mass = 0.25", "mass = -1", r"\[rigid_body\.mirror\] .*mass must be above 0 kg, got -1"),
        ("mass = 0.25", "mass = true", r"\[rigid_body\.mirror\] .*mass must be one number \[kg\], got True"),
        ("mass = 0.25", "mass = 2026-01-01", r"\[rigid_body\.mirror\] .*mass must be one number"),
        ("mass = 0.25", "", r"\[rigid_body\.mirror\] .*mass= \[kg\] is missing"),
        ("mass = 0.25", "mass = nan", r"mass must be finite"),
        ("mass = 0.25", "mass = 1" + "0" * 400, r"mass: a whole number of 401 digits is too large"),
        ("mass = 0.25", "mass = 1e999", r"mass must be finite .* got inf"),
        (
            "12*E*I/length^3",
            "12*E*J/length^3",
            r"\[connection\.mount\] stiffness: '12\*E\*J/length\^3': 'J' is not known. Known: 'E'",
        ),
        ("inf, 1e3", '"inf", 1e3', r"stiffness: write inf without the quotes"),
        ("[1e7,", "[[[[[1]]]],", r"stiffness: has lists in lists more than 3 deep"),
        (
            '["platform", "mirror"]',
            '["platform", "miror"]',
            r"\[connection\.mount\] .*'miror' is not in the model. Did you mean 'mirror'",
        ),
        (
            '["platform", "mirror"]',
            '"platform"',
            r"\[connection\.mount\] between: must name two items, as .* got 'platform'",
        ),
        ("I = ", "length = 3\nI = ", r"mirror\.toml: .*line \d+"),
        ('I = "width*', 'I = "I*width*', r"mirror\.toml: \[parameters\] .*in a circle: I -> I"),
        ("E = 113e9", "E = [1]", r"\[parameters\] E: must be a number or an expression in quotes, got \[1\]"),
        ("E = 113e9", "sqrt = 1", r"\[parameters\] a parameter cannot be called 'sqrt'"),
        (
            '"base_motion"',
            '"base_motoin"',
            r"\[input\.shake\] type: 'base_motoin' is not known\. Did you mean 'base_motion'",
        ),
        ('type = "base_motion"', "", r"\[input\.shake\] type: is missing"),
        ('item = "mirror"', "item = 3", r"\[sensor\.Y1\] item: must be a text in quotes, as item = "),
        ("sense = ", "sence = ", r"\[requirement\.\"first mode\"\] sence: unknown key. Did you mean 'sense'"),
        ("mode = 1\n", "mode = 1.5\n", r"\[requirement\.\"first mode\"\] .*whole number from 1, got 1.5"),
        ("mode = 1\n", "", r"\[requirement\.\"first mode\"\] mode: is missing"),
        ('name = "mirror module"', 'axis = "rw"', r"\[model\] .*axis 'rw' is not known"),
        ('name = "mirror module"', 'order = ["mirror"]', r"\[model\] order: must name each fixation and body once"),
        ("[fixation.platform]", "[fixation]\nplatform = 3\n[x]", r"unknown table"),
        (
            "[fixation.platform]\nposition = [0, 0, 0]",
            "[fixation]\nplatform = 3",
            r"\[fixation\.platform\]: must be a table of keys and values, got 3",
        ),
        ("[sensor.Y1]", "[sensor.shake]", r"\[sensor\.shake\] the name 'shake' is taken"),
    ],
)
def test_errors_name_the_place(write, old, new, words):
    assert old in TABLE_1
    with pytest.raises(ibs.ModelFileError, match=words):
        ibs.Model.from_toml(write(TABLE_1.replace(old, new, 1)))


def test_a_syntax_error_has_its_line_and_shows_it(write):
    with pytest.raises(ibs.ModelFileError, match=r"mirror\.toml: .*line 18.*: inertia = "):
        ibs.Model.from_toml(write(TABLE_1.replace("cog = [0, 0, 0.08]", "cog = [0, 0")))


def test_a_missing_file_names_its_neighbours(write, tmp_path):
    write(TABLE_1)
    with pytest.raises(FileNotFoundError, match=r"miror\.toml does not exist\. Beside it: mirror\.toml"):
        ibs.Model.from_toml(tmp_path / "miror.toml")
    with pytest.raises(ibs.ModelFileError, match="is no file but a folder"):
        ibs.Model.from_toml(tmp_path)
    with pytest.raises(ibs.ModelFileError, match="must be a text or a Path, got 3"):
        ibs.Model.from_toml(3)
    with pytest.raises(ibs.ModelFileError, match="null character"):
        ibs.Model.from_toml("a\0b")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ('reduced = "gone.npz"', r"gone\.npz does not exist"),
        ('reduced = "a.npz"\nexport = "b.inp"', r"give either reduced .* or export"),
        ("zeta = 0.01", r"give either reduced .* or export"),
        ('reduced = "a.npz"\nunits = "SI"', r"units: belongs to an export"),
        ('export = "flexure.inp"\nmax_frequency = 1', r"interfaces: is missing"),
        ('export = "b.inp"\ninterfaces = {a = "A"}\nmax_frequency = 1', r"No matrices lie beside b\.inp|b\.inp"),
        ('reduced = "a.npz"\nfrequency = 3', r"frequency: unknown key"),
        ("reduced = 3", r"reduced: must be a text"),
    ],
)
def test_flexible_bodies_that_cannot_be(write, values, words):
    with pytest.raises(ibs.ModelFileError, match=r"mirror\.toml: \[flexible_body\.f\].*" + words):
        ibs.Model.from_toml(write(f"[flexible_body.f]\n{values}\n"))


# -- hostile files


def test_paths_stay_inside_the_folder(write, tmp_path):
    inside = tmp_path / "project"
    inside.mkdir()
    body().save(tmp_path / "secret.npz")
    (inside / "link.npz").symlink_to(tmp_path / "secret.npz")
    for path in ("../secret.npz", str(tmp_path / "secret.npz"), "link.npz", "a/../../secret.npz"):
        file = write(f'[flexible_body.f]\nreduced = "{path}"\n', "project/m.toml")
        with pytest.raises(ibs.ModelFileError, match="leads out of the folder"):
            ibs.Model.from_toml(file)
        if ".." not in path or path.startswith(".."):
            assert "f" in ibs.Model.from_toml(file, allow_outside=True).items
    with pytest.raises(ibs.ModelFileError, match="is no path"):
        ibs.Model.from_toml(write('[flexible_body.f]\nreduced = "a\\u0000b"\n', "project/m.toml"))
    loop = inside / "loop"
    loop.symlink_to(loop)
    with pytest.raises(ibs.ModelFileError):
        ibs.Model.from_toml(write('[flexible_body.f]\nreduced = "loop/a.npz"\n', "project/m.toml"))


@pytest.mark.parametrize(
    "expression", ["__import__('os').system('touch hit')", "().__class__", "open('hit','w')", "E.real"]
)
def test_code_in_an_expression_is_not_run(write, tmp_path, monkeypatch, expression):
    monkeypatch.chdir(tmp_path)
    for place in ("mass = 0.25", 'I = "width*thickness^3/12"'):
        key = place.split(" ")[0]
        with pytest.raises(ibs.ModelFileError):
            ibs.Model.from_toml(write(TABLE_1.replace(place, f'{key} = "{expression}"')))
    assert not (tmp_path / "hit").exists()


def test_encodings(write):
    with_bom = TABLE_1.encode("utf-8-sig")
    assert ibs.Model.from_toml(write(with_bom)) == ibs.Model.from_toml(write(TABLE_1))
    assert ibs.Model.from_toml(write(TABLE_1.replace("\n", "\r\n"))) == ibs.Model.from_toml(write(TABLE_1))
    for encoding in ("utf-16", "utf-16-le", "utf-16-be", "utf-32"):
        with pytest.raises(ibs.ModelFileError, match=r"mirror\.toml is in UTF-16.*save it as UTF-8"):
            ibs.Model.from_toml(write(TABLE_1.encode(encoding)))
    with pytest.raises(ibs.ModelFileError, match=r"line 3 has the byte 0xe9, which is not UTF-8"):
        ibs.Model.from_toml(write(TABLE_1.replace("mirror module", "modulé").encode("latin-1")))
    for content in (b"", b"\xff\xfe", b"\x7fELF\x00\x00", bytes(range(256))):
        with contextlib.suppress(ibs.ModelFileError):
            assert not ibs.Model.from_toml(write(content)).items


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 100_000,
        "a = " + "[" * 5_000 + "]" * 5_000,
        "a = " + "{a=" * 5_000 + "1" + "}" * 5_000,
        "[" + "a." * 2_000_000 + "a]",
        "a." * 2_000_000 + "a = 1",
        "x = {" + '"b,".' * 100_000 + "a = 1}",
        "[rigid_body." + "a." * 3_000 + "a]",
        "[model]\nname = " + "9" * 10_000,
        '[rigid_body.m]\nmass = "' + "(" * 100_000 + '"',
        "[connection.c]\nbetween = " + "[" * 400 + "1" + "]" * 400,
        "[rigid_body.m]\nmass = " + "[" * 400 + "1" + "]" * 400,
    ],
    ids=range(11),
)
def test_deep_and_large_texts_are_refused_in_words(write, text):
    with pytest.raises(ibs.ModelFileError) as caught:
        ibs.Model.from_toml(write(text))
    assert len(str(caught.value)) < 2000


def test_huge_files_are_not_read(write, tmp_path):
    path = tmp_path / "huge.toml"
    with open(path, "wb") as stream:
        stream.truncate(1 << 40)  # a sparse file: a terabyte that takes no room
    with pytest.raises(ibs.ModelFileError, match="bytes; at most"):
        ibs.Model.from_toml(path)
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.toml")
        with pytest.raises(ibs.ModelFileError, match="no file but a device"):
            ibs.Model.from_toml(tmp_path / "pipe.toml")


def _model_or_words(read):
    try:
        return read()
    except ibs.ModelFileError as error:
        return str(error)


_scalars = st.one_of(
    st.none().map(lambda _: 1e400),
    st.floats(),
    st.integers(-(10**400), 10**400),
    st.booleans(),
    st.text(max_size=10),
    st.sampled_from(["mirror", "platform", "x", "E*2", "inf", "../x"]),
)
_values = st.recursive(_scalars, lambda inner: st.lists(inner, max_size=7), max_leaves=10)
_keys = st.sampled_from(
    ["mass", "cog", "inertia", "position", "between", "stiffness", "zeta", "axes", "damping"]
    + ["type", "item", "direction", "quantity", "limit", "input", "output", "band", "mode", "disturbances"]
    + ["reduced", "export", "interfaces", "max_frequency", "psd", "psds", "inputs", "frequency", "amplitude"]
)
_kinds = st.sampled_from(
    ["model", "parameters", "fixation", "rigid_body", "connection", "flexible_body"]
    + ["input", "sensor", "disturbance", "requirement"]
)


@given(
    st.dictionaries(_kinds, st.dictionaries(names, st.dictionaries(_keys, _values, max_size=5) | _values, max_size=3))
)
@settings(max_examples=300, deadline=None, suppress_health_check=RELAXED)
def test_any_tables_give_a_model_or_an_error_in_words(document):
    from ibsdyn.model_files.reading import model_of

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ibs.ModelWarning)
        outcome = _model_or_words(lambda: model_of(document, Path("fuzz.toml")))
    assert isinstance(outcome, ibs.Model) or "fuzz.toml" in outcome


@given(st.binary(max_size=200), st.integers(0, len(TABLE_1)))
@settings(max_examples=200, deadline=None, suppress_health_check=RELAXED)
def test_any_bytes_in_a_good_file_give_a_model_or_an_error_in_words(tmp_path, noise, place):
    text = TABLE_1.encode()
    path = tmp_path / "noise.toml"
    path.write_bytes(text[:place] + noise + text[place + len(noise) :])
    outcome = _model_or_words(lambda: ibs.Model.from_toml(path))
    assert isinstance(outcome, ibs.Model) or "noise.toml" in outcome


# -- the starter file


def test_the_starter_file_reads_checks_and_meets_its_requirements():
    model = ibs.Model.from_toml(Path(ibs.__file__).with_name("starter.toml"))
    assert model.check() == []
    # Two leaf springs side by side are a parallel guide: k = 2 · 12 E I / L³, the mirror hardly turns.
    stiffness = 2 * 12 * 113e9 * (35e-3 * 0.4e-3**3 / 12) / 22e-3**3
    guided = math.sqrt(stiffness / 0.25) / (2 * math.pi)
    frequencies = model.linearize().modes().frequencies
    assert frequencies[0] == pytest.approx(guided, rel=2e-3)
    assert frequencies[1] > 10 * frequencies[0]
    assert all(result.met for result in model.check_requirements())


# -- a file that is there already


def test_comments_and_expressions_stay_where_nothing_changed(tmp_path):
    path = tmp_path / "starter.toml"
    before = Path(ibs.__file__).with_name("starter.toml").read_text(encoding="utf-8")
    path.write_text(before, encoding="utf-8")
    model = ibs.Model.from_toml(path)
    model.to_toml(path)
    assert path.read_text(encoding="utf-8") == before
    changed = ibs.Model(model.name)
    changed.fixation("platform")
    changed.rigid_body("mirror", 0.3, model.items["mirror"].cog, model.items["mirror"].inertia)
    for name, c in model.connections.items():
        k = (3e4, *c.stiffness[1:])
        changed.connection(name, c.item1, c.item2, c.position1, c.position2, k, c.zeta)
    for signal in model.inputs.values():
        changed.add_input(signal)
    changed.add_sensor(ibs.Sensor("mirror", "x", name="Y1"))
    changed.to_toml(path)
    assert ibs.Model.from_toml(path) == changed
    after = path.read_text(encoding="utf-8").splitlines()
    gone = [line for line in before.splitlines() if line not in after]
    assert any(line.startswith("mass = 0.3 ") and line.endswith("# [kg]") for line in after)
    assert after.count('    "G * J / leaf_length",') == 2
    assert 'I_soft = "leaf_width * leaf_thickness^3 / 12"' in after
    assert not any("jitter" in line for line in after)
    assert not any("parameters" in line or "leaf_" in line for line in gone if "I_soft / leaf_length^3" not in line)


def test_an_export_stays_while_it_is_still_the_body(tmp_path):
    for name in os.listdir(EXPORT):
        (tmp_path / name).write_bytes((EXPORT / name).read_bytes())
    text = '# mine\n[flexible_body.flexure]\nexport = "flexure.inp"  # of the designer\n'
    text += 'max_frequency = 900\ncache = "kept"\n'
    path = tmp_path / "m.toml"
    path.write_text(text + '[flexible_body.flexure.interfaces]\nbase = "BASE"\ntip = "TIP"\n', encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ExportWarning)
        model = ibs.Model.from_toml(path)
        model.fixation("platform")
        model.to_toml(path)
        assert "# of the designer" in path.read_text(encoding="utf-8")
        assert ibs.Model.from_toml(path) == model
        model.remove("flexure")
        model.flexible_body("flexure", body())
        model.to_toml(path)
    after = path.read_text(encoding="utf-8")
    assert "export" not in after
    assert after.startswith("# mine")
    assert ibs.Model.from_toml(path) == model


def test_what_cannot_be_kept_is_said(tmp_path):
    path = tmp_path / "m.toml"
    (tmp_path / "bodies.csv").write_text("name,x,y,z\nframe,0,0,0\n", encoding="utf-8")
    path.write_text('# mine\n[model]\ntables = "bodies.csv"\n', encoding="utf-8")
    model = ibs.Model.from_toml(path)
    model.remove("frame")
    model.fixation("frame", position=(0, 0, 1))
    with pytest.warns(ibs.ModelWarning, match=r"m\.toml is written anew; the comments"):
        model.to_toml(path)
    assert ibs.Model.from_toml(path) == model


@given(models(), models())
@settings(max_examples=25, deadline=None, suppress_health_check=RELAXED)
def test_any_model_over_any_other_is_read_back_to_the_last_digit(tmp_path, first, second):
    path = tmp_path / "over.toml"
    path.unlink(missing_ok=True)
    first.to_toml(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ibs.ModelWarning)  # a # in a name looks like a comment
        second.to_toml(path)
    assert ibs.Model.from_toml(path) == second
