"""Results in other programs' forms, read back by other programs' readers."""

import csv
import os
import sys

import numpy as np
import pytest
import scipy.io

import ibsdyn as ibs


@pytest.fixture(scope="module")
def module():
    model = ibs.Model("module")
    model.fixation("platform", position=(0, 0, 0.01))
    model.rigid_body("base", mass=1.5, cog=(0, 0.01, 0.02), inertia=(1e-3, 1e-3, 2e-3, 0, 0, 0))
    model.rigid_body("mirror", mass=0.25, cog=(0.002, 0, 0.08), inertia=(1e-4, 1.1e-4, 2e-4, 1e-6, 0, 0))
    for name, ends, z in (("mount", ("platform", "base"), 0.01), ("glue", ("base", "mirror"), 0.05)):
        model.connection(name, *ends, position1=(0, 0, z), stiffness=(1e6, 1e6, 2e6, 400, 500, 600), zeta=0.01)
    return model


@pytest.fixture(scope="module")
def system(module):
    return module.linearize()


INPUTS = [ibs.BaseMotion("platform", "x", name="shake"), ibs.Torque("mirror", "ry", name="push, hard")]
OUTPUTS = [ibs.Sensor("mirror", "x", name="Y1"), ibs.Sensor("base", "rz", quantity="displacement", name="tilt / z")]


@pytest.fixture(scope="module", params=["even", "log"])
def frf(request, system):
    frequencies = np.linspace(1, 500, 200) if request.param == "even" else np.geomspace(1, 1000, 201)
    return system.frf(INPUTS, OUTPUTS, frequencies)


def same_signals(read, frf):
    assert (read.outputs, read.inputs) == (frf.outputs, frf.inputs)
    assert (read.output_units, read.input_units) == (frf.output_units, frf.input_units)


def test_csv_of_responses_keeps_every_digit(frf, tmp_path):
    ibs.write_frf(frf, tmp_path / "frf.csv")
    read = ibs.read_frf(tmp_path / "frf.csv")
    same_signals(read, frf)
    np.testing.assert_array_equal(read.frequencies, frf.frequencies)
    np.testing.assert_array_equal(read.response, frf.response)
    with open(tmp_path / "frf.csv", encoding="utf-8-sig", newline="") as stream:
        titles, first, *_ = csv.reader(stream)
    assert titles[:2] == ["frequency [Hz]", "real Y1 [m/s²] / shake [m/s²]"]
    assert complex(float(first[3]), float(first[4])) == frf.response[0, 1, 0]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "no table"),
        (b"a,b\n1,x\n", "no table"),
        (b"frequency [Hz],H\n1,2\n", "the columns must be 'frequency"),
        (b"frequency [Hz],real a [m] / b [N]\n1,2\n", "has a real and an imaginary part"),
        (b"frequency [Hz],real a [m] / b [N],imag a [m] / b [N]\n1,nan,2\n", "finite"),
        (b"frequency [Hz],real a [m] / b [N],imag a [m] / b [N]\n1,2\n", "a finite number in each line"),
        (b"\xff\xfe\x00", "no table"),
    ],
)
def test_tables_that_are_none(tmp_path, content, words):
    (tmp_path / "frf.csv").write_bytes(content)
    with pytest.raises(ibs.InterchangeError, match=words):
        ibs.read_frf(tmp_path / "frf.csv")


def test_universal_file_of_responses(frf, tmp_path):
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "frf.unv"
    ibs.write_frf(frf, path)
    read = ibs.read_frf(path)
    same_signals(read, frf)
    np.testing.assert_allclose(read.frequencies, frf.frequencies, rtol=1e-5)
    np.testing.assert_allclose(read.response, frf.response, rtol=1e-10)
    one = pyuff.UFF(str(path)).read_sets(1)  # shake is input 1, the torque input 2
    assert (one["func_type"], one["rsp_node"], one["ref_node"]) == (4, 1, 4)
    assert (one["ordinate_spec_data_type"], one["orddenom_spec_data_type"]) == (12, 13)
    assert one["orddenom_axis_units_lab"].strip() == "N*m"
    assert one["ref_ent_name"].strip() == "push, hard"
    assert max(len(line.rstrip("\n")) for line in path.read_text().splitlines()) <= 80


def test_universal_file_of_a_test_system(tmp_path):
    """As analysers write them: nodes with directions, g over N, coherences and time histories among the functions."""
    pyuff = pytest.importorskip("pyuff")
    x = np.arange(1.0, 6.0)
    axes = {"abscissa_spec_data_type": 18, "abscissa_spacing": 1, "ordinate_axis_units_lab": "g"}
    common = {"type": 58, "ref_node": 3, "ref_dir": -3, "orddenom_axis_units_lab": "N", "orddenom_spec_data_type": 13}
    rows = [
        common | axes | {"func_type": kind, "rsp_node": node, "rsp_dir": way, "x": x, "data": data}
        for kind, node, way, data in (
            (4, 12, 3, x * (1 + 2j)),
            (6, 12, 3, x / 10),
            (4, 7, -5, x * 1j),
        )
    ]
    path = tmp_path / "test.uff"
    pyuff.UFF(str(path)).write_sets(rows, mode="overwrite")
    read = ibs.read_frf(path)
    assert read.outputs == ("12:+Z", "7:-RY")
    assert read.inputs == ("3:-Z",)
    assert read.output_units == ("m/s²", "m/s²")
    np.testing.assert_allclose(read.frequencies, x)
    np.testing.assert_allclose(read.response[0, 0], 9.80665 * x * (1 + 2j), rtol=1e-10)
    for change, words in (
        ({"rsp_node": 12, "rsp_dir": 3}, r"12:\+Z over 3:-Z is there twice"),
        ({"ref_node": 4}, r"over .* is missing"),
        ({"x": 2 * x}, "has other frequencies"),
    ):
        pyuff.UFF(str(path)).write_sets([*rows[:2], rows[2] | change], mode="overwrite")
        with pytest.raises(ibs.InterchangeError, match=words):
            ibs.read_frf(path)
    pyuff.UFF(str(path)).write_sets(rows[1:2], mode="overwrite")
    with pytest.raises(ibs.InterchangeError, match=r"no frequency response functions .* 1 functions"):
        ibs.read_frf(path)
    whole = path.read_bytes()
    for damaged in (b"", b"nonsense", whole[: len(whole) // 2], b"\xff" * 500):
        path.write_bytes(damaged)
        with pytest.raises(ibs.InterchangeError, match=r"test\.uff"):
            ibs.read_frf(path)


def test_universal_file_of_modes(system, tmp_path):
    pyuff = pytest.importorskip("pyuff")
    modes = system.modes()
    path = tmp_path / "modes.uff"
    ibs.write_modes(modes, path)
    sets = pyuff.UFF(str(path)).read_sets()
    kinds = [one["type"] for one in sets]
    assert kinds == [164, 2411, 82, 82] + [55] * 12
    nodes = sets[1]
    places = {
        tuple(np.round([nodes["x"][i], nodes["y"][i], nodes["z"][i]], 12)): int(n)
        for i, n in enumerate(nodes["node_nums"])
    }
    assert set(places) == {(0, 0, 0.01), (0, 0.01, 0.02), (0.002, 0, 0.08)}
    mirror = places[0.002, 0, 0.08]
    assert sets[3]["id"].strip() == "glue"
    assert list(sets[3]["nodes"]) == [places[0, 0.01, 0.02], mirror]
    rows = [modes.coordinates.index(f"mirror.{d}") for d in ("x", "y", "z", "rx", "ry", "rz")]
    for number, one in enumerate(sets[4:]):
        assert one["freq"] == pytest.approx(modes.frequencies[number], rel=1e-5)
        assert one["modal_damp_vis"] == pytest.approx(0.01, rel=1e-5)
        at = list(one["node_nums"]).index(mirror)
        shape = [one[f"r{d}"][at] for d in range(1, 7)]
        np.testing.assert_allclose(shape, modes.shapes[rows, number], rtol=1e-5, atol=1e-30)
        still = list(one["node_nums"]).index(places[0, 0, 0.01])
        assert not any(one[f"r{d}"][still] for d in range(1, 7))


def test_csv_of_modes(system, tmp_path):
    ibs.write_modes(system.modes(), tmp_path / "modes.csv")
    with open(tmp_path / "modes.csv", encoding="utf-8-sig", newline="") as stream:
        rows = list(csv.DictReader(stream))
    modes = system.modes()
    assert [float(row["frequency [Hz]"]) for row in rows] == modes.frequencies.tolist()
    assert [float(row["shape mirror.rz"]) for row in rows] == modes.shapes[
        modes.coordinates.index("mirror.rz")
    ].tolist()
    assert sum(float(rows[0][f"strain energy {name} [-]"]) for name in ("mount", "glue")) == pytest.approx(1.0)


def test_modes_of_flexible_bodies_and_concepts_have_nodes_too(tmp_path):
    pyuff = pytest.importorskip("pyuff")
    concept = ibs.Model("concept", axis="rz")
    concept.fixation("frame")
    concept.rigid_body("mirror", inertia=2e-4)
    concept.connection("k", "frame", "mirror", stiffness=500.0)
    ibs.write_modes(concept.linearize().modes(), tmp_path / "m.uff")
    (shape,) = (one for one in pyuff.UFF(str(tmp_path / "m.uff")).read_sets() if one["type"] == 55)
    turned = 1 / np.sqrt(2e-4)  # unit modal mass
    assert sorted(np.abs(shape["r6"])) == pytest.approx([0.0, turned], rel=1e-5)
    assert not np.any([shape[f"r{d}"] for d in range(1, 6)])


def test_matlab_gets_matrices_and_a_state_space(system, tmp_path):
    ibs.write_matrices(system, tmp_path / "m.mat", INPUTS, OUTPUTS)
    read = scipy.io.loadmat(tmp_path / "m.mat", simplify_cells=True)
    for name in ("M", "C", "K", "K_base"):
        np.testing.assert_array_equal(read[name], getattr(system, name))
    assert list(read["coordinates"]) == list(system.coordinates)
    assert list(read["ss"]["InputName"]) == ["shake", "push, hard"]
    assert list(read["ss"]["OutputUnit"]) == ["m/s²", "rad"]
    # another road to the same response: C (s - A)^-1 B + D by hand
    space = read["ss"]
    frequencies = np.array([3.0, 40.0, 300.0])
    own = system.frf(INPUTS, OUTPUTS, frequencies).response
    for place, frequency in enumerate(frequencies):
        resolvent = 2j * np.pi * frequency * np.eye(len(space["A"])) - space["A"]
        by_hand = space["C"] @ np.linalg.solve(resolvent, space["B"]) + space["D"]
        np.testing.assert_allclose(by_hand, own[:, :, place], rtol=1e-7)


def test_matlab_gets_responses(frf, tmp_path):
    ibs.write_frf(frf, tmp_path / "frf.mat")
    read = scipy.io.loadmat(tmp_path / "frf.mat", simplify_cells=True)
    np.testing.assert_array_equal(read["H"], frf.response)
    np.testing.assert_array_equal(read["frequencies"], frf.frequencies)
    assert list(read["outputs"]) == list(frf.outputs)


def test_python_control_gives_the_same_response(system):
    pytest.importorskip("control")
    plant = system.to_state_space(INPUTS, OUTPUTS).to_control()
    assert plant.input_labels == ["shake", "push, hard"]
    frequencies = np.array([3.0, 40.0, 300.0])
    own = system.frf(INPUTS, OUTPUTS, frequencies).response
    np.testing.assert_allclose(plant(2j * np.pi * frequencies), own, rtol=1e-7, atol=1e-9 * np.abs(own).max())


def test_xarray_and_pandas_views(frf, system):
    xarray = pytest.importorskip("xarray")
    pandas = pytest.importorskip("pandas")
    array = frf.to_xarray()
    assert isinstance(array, xarray.DataArray)
    np.testing.assert_array_equal(array.sel(output="Y1", input="shake").values, frf.response[0, 0])
    assert array.sel(output="Y1").output_unit == "m/s²"
    assert array.frequency.attrs["units"] == "Hz"
    frame = frf.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    np.testing.assert_array_equal(frame["tilt / z", "push, hard"].to_numpy(), frf.response[1, 1])
    table = system.modes().to_dataframe()
    assert table.loc[1, "frequency [Hz]"] == system.modes().frequencies[0]
    record = ibs.TimeRecord([[1.0, 2.0], [3.0, 4.0]], ["a", "b"], ["m", "N"], sample_rate=10.0)
    assert record.to_dataframe()["b"].tolist() == [3.0, 4.0]
    assert record.to_xarray().sel(channel="a").values.tolist() == [1.0, 2.0]
    assert record.to_xarray().time.values.tolist() == [0.0, 0.1]


def test_endings_names_and_half_given_signals(frf, system, tmp_path):
    with pytest.raises(ibs.InterchangeError, match=r"not written as '\.xls'\. .*'\.csv'"):
        ibs.write_frf(frf, tmp_path / "a.xls")
    with pytest.raises(ibs.InterchangeError, match=r"not read as '\.mat'"):
        ibs.read_frf(tmp_path / "a.mat")
    with pytest.raises(ibs.InterchangeError, match="modes are written as one of"):
        ibs.write_modes(system.modes(), tmp_path / "a.mat")
    with pytest.raises(ibs.InterchangeError, match=r"let the path end in \.mat"):
        ibs.write_matrices(system, tmp_path / "a.csv")
    with pytest.raises(ibs.InterchangeError, match="or neither"):
        ibs.write_matrices(system, tmp_path / "a.mat", INPUTS)
    with pytest.raises(FileNotFoundError):
        ibs.read_frf(tmp_path / "a.csv")
    renamed = ibs.FrequencyResponse(frf.frequencies, frf.response[:1, :1], ("Y\n1",), ("u",), ("m",), ("N",))
    with pytest.raises(ibs.InterchangeError, match="fit one line"):
        ibs.write_frf(renamed, tmp_path / "a.csv")
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize(
    ("package", "extra", "use"),
    [
        ("pyuff", "uff", lambda frf, system, path: ibs.write_frf(frf, path / "a.uff")),
        ("pyuff", "uff", lambda frf, system, path: ibs.read_frf(path / "a.unv")),
        ("pyuff", "uff", lambda frf, system, path: ibs.write_modes(system.modes(), path / "a.uff")),
        ("xarray", "xarray", lambda frf, system, path: frf.to_xarray()),
        ("pandas", "pandas", lambda frf, system, path: frf.to_dataframe()),
        ("control", "control", lambda frf, system, path: system.to_state_space(INPUTS, OUTPUTS).to_control()),
    ],
)
def test_a_missing_package_is_answered_with_its_extra(frf, system, tmp_path, monkeypatch, package, extra, use):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ImportError, match=rf'pip install "ibsdyn\[{extra}\]"'):
        use(frf, system, tmp_path)
    assert not os.listdir(tmp_path)


def test_a_folder_that_is_not_there_is_named_and_not_the_temporary_file_in_it(tmp_path):
    model = ibs.Model("one", axis="x")
    model.fixation("floor")
    model.rigid_body("box", mass=1.0)
    model.connection("spring", "floor", "box", stiffness=1e4, zeta=0.01)
    frf = model.linearize().frf(ibs.Force("box", "x"), ibs.Sensor("box", "x"), [10.0])
    target = tmp_path / "absent" / "frf.csv"
    with pytest.raises(OSError, match="does not exist; make it first") as refused:
        ibs.write_frf(frf, target)
    assert refused.value.filename == str(target)
