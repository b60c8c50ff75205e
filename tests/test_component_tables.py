"""Tables of components as CAD programs and spreadsheets write them, against the same model made by hand."""

import math
import sys
import zipfile

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import ibsdyn as ibs
from ibsdyn.units import si_factor


def by_hand():
    model = ibs.Model("m")
    model.fixation("frame", position=(0, 0, 0.01))
    model.rigid_body("mirror", mass=0.25, cog=(0.001, 0, 0.08), inertia=(1e-4, 1.1e-4, 2e-4, 1e-6, 0, 0))
    model.rigid_body("base", mass=1.5, cog=(0, 0, 0.02), inertia=(1e-3, 1e-3, 2e-3, 0, 0, 0))
    model.connection(
        "mount",
        "frame",
        "base",
        position1=(0, 0, 0.01),
        position2=(0, 0, 0.012),
        stiffness=(1e7, 1e7, math.inf, 1e3, 1e3, 2e3),
        zeta=0.01,
    )
    model.connection("glue", "base", "mirror", position1=(0, 0, 0.05), stiffness=(2e8,) * 3 + (4e4,) * 3, zeta=0.02)
    return model


BODIES = """name,mass [g],CoG x [mm],CoG y [mm],CoG z [mm],\
Ixx [g mm^2],Iyy [g mm^2],Izz [g mm^2],Ixy [g mm^2],Ixz [g mm^2],Iyz [g mm^2]
mirror,250,1,0,80,1e5,1.1e5,2e5,1e3,0,0
base,1500,0,0,20,1e6,1e6,2e6,0,0,0
"""
SPRINGS = """# springs of the mirror module
name;from;to;position1.x [mm];position1.y [mm];position1.z [mm];position2.x [mm];position2.y [mm];position2.z [mm];\
kx [N/µm];ky [N/µm];kz [N/µm];kxx [Nm/rad];kyy [Nm/rad];kzz [kN mm/rad];zeta [%]
mount;frame;base;0;0;10;0;0;12;10;10;inf;1000;1000;2000;1
glue;base;mirror;0;0;50;;;;200;2e2;200;40000;40000;40000;2,0
"""


def close(model, other):
    """Conversions of units may round; names, order and structure may not."""
    assert list(model.items) == list(other.items)
    assert list(model.connections) == list(other.connections)
    for name, item in other.items.items():
        for field in ("mass", "cog", "inertia", "position"):
            if hasattr(item, field):
                assert getattr(model.items[name], field) == pytest.approx(getattr(item, field), rel=1e-14)
    for name, c in other.connections.items():
        read = model.connections[name]
        assert (read.item1, read.item2) == (c.item1, c.item2)
        for field in ("position1", "position2", "stiffness", "zeta"):
            assert getattr(read, field) == pytest.approx(getattr(c, field), rel=1e-14)


@pytest.fixture
def write(tmp_path):
    def written(text, name, encoding="utf-8"):
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
        return tmp_path / name

    return written


def test_a_table_a_kind_with_units_and_semicolons(write):
    model = ibs.Model("m")
    model.fixation("frame", position=(0, 0, 0.01))
    model.add_table(write(BODIES, "bodies.csv"))
    model.add_table(write(SPRINGS, "springs.csv"))
    close(model, by_hand())


def test_one_table_with_a_kind_column_and_decimal_commas(write):
    text = """Type;Name;From;To;X;Y;Z;mass [kg];Ixx;Iyy;Izz;Ixy;Ixz;Iyz;kx;ky;kz;kxx;kyy;kzz;zeta
connection;mount;frame;base;0;0;0,01;;;;;;;;1e7;1e7;rigid;1000;1000;2000;0,01
fixation;frame;;;0;0;0,01;;;;;;;;;;;;;;
Rigid body;mirror;;;0,001;0;0,08;0,25;0,0001;1,1e-4;2e-4;1e-6;0;0;;;;;;;
body;base;;;0;0;0,02;1,5;0,001;0,001;0,002;0;0;0;;;;;;;

connection;glue;base;mirror;0;0;0,05;;;;;;;;200000000;2e8;2e8;40000;40000;40000;0,02
"""
    model = ibs.Model("m")
    model.add_table(write(text, "machine.csv", "utf-8-sig"))
    expected = by_hand()
    assert model.items == expected.items
    assert model.connections["glue"] == expected.connections["glue"]
    assert model.connections["mount"].position2 == (0, 0, 0.01)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_encodings_of_spreadsheet_programs(write, encoding):
    model = ibs.Model("m")
    model.add_table(write(BODIES.replace("mirror", "Spiegel Ø"), "bodies.csv", encoding))
    assert "Spiegel Ø" in model.items


def test_windows_text_is_read_with_a_warning(write):
    model = ibs.Model("m")
    path = write(BODIES.replace("mirror", "Spiegel Ø").replace("g mm^2", "g mm²"), "bodies.csv", "cp1252")
    with pytest.warns(ibs.ModelWarning, match=r"bodies\.csv is not UTF-8; it is read as Windows-1252"):
        model.add_table(path)
    assert "Spiegel Ø" in model.items


def test_tabs_quotes_titles_and_excels_first_line(write):
    text = '"My machine"\t\t\t\t\n\nname\tx [mm]\ty [mm]\tz [mm]\n"frame ""A"""\t1\t2\t3\n'
    model = ibs.Model("m")
    model.add_table(write(text, "fixations.txt"))
    assert model.items['frame "A"'].position == (0.001, 0.002, 0.003)
    model.add_table(write('sep=,\nname,x,y,z\nframe B,"0,5",0,0\n', "more.csv"))
    assert model.items["frame B"].position == (0.5, 0, 0)


def test_a_one_dimensional_table(write):
    model = ibs.Model("concept", axis="rz")
    model.add_table(write("name,inertia [kg mm^2]\nmirror,200\n", "bodies.csv"))
    model.add_table(write("name\nframe\n", "f.csv"))
    model.add_table(write("name,item1,item2,stiffness [Nmm/mrad],zeta\nk,frame,mirror,500,0.01\n", "k.csv"))
    assert model.items["mirror"].inertia == pytest.approx(2e-4, rel=1e-14)
    assert model.connections["k"].stiffness == pytest.approx((500.0,), rel=1e-14)


def test_a_spreadsheet_with_a_sheet_a_kind(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheets = [("notes", [["made by", "me"]]), ("fixation", [["name", "x", "y", "z [mm]"], ["frame", 0, 0, 10]])]
    for title, text, divider in (("bodies", BODIES, ","), ("springs", SPRINGS.replace("2,0", "2"), ";")):
        rows = [line.split(divider) for line in text.splitlines() if not line.startswith("#")]
        numbers = [[_number(cell) for cell in row] for row in rows]
        sheets.append((title, [["Title of the sheet"], [], *numbers]))
    for title, rows in sheets:
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(row)
    book.save(tmp_path / "machine.xlsx")
    model = ibs.Model("m")
    model.add_table(tmp_path / "machine.xlsx")
    close(model, by_hand())


def _number(cell):
    try:
        return float(cell) if cell != "inf" else cell
    except ValueError:
        return cell or None


def test_spreadsheets_that_are_none(write, tmp_path, monkeypatch):
    pytest.importorskip("openpyxl")
    model = ibs.Model("m")
    with pytest.raises(ibs.ModelFileError, match=r"a\.xlsx is no spreadsheet or damaged"):
        model.add_table(write("name,x\n", "a.xlsx"))
    with pytest.raises(ibs.ModelFileError, match=r"old \.xls is not read"):
        model.add_table(write("", "a.xls"))
    with pytest.raises(ibs.ModelFileError, match=r"give it the ending \.xlsx"):
        model.add_table(write(b"PK\x03\x04", "a.csv"))
    with zipfile.ZipFile(tmp_path / "bomb.xlsx", "w", zipfile.ZIP_DEFLATED) as bomb:
        for part in range(3):
            bomb.writestr(f"xl/sharedStrings{part}.xml", bytes(100 * 2**20))
    with pytest.raises(ibs.ModelFileError, match=r"bomb\.xlsx unpacks to 314572800 bytes; at most"):
        model.add_table(tmp_path / "bomb.xlsx")
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(ImportError, match=r'pip install "ibsdyn\[excel\]"'):
        model.add_table(write("", "a.xlsx"))


def test_a_model_file_refers_to_tables_whose_cells_know_its_parameters(write, tmp_path):
    write(BODIES, "bodies.csv")
    write("name,item1,item2,x,y,z [mm],kx,ky,kz,kxx,kyy,kzz\nmount,frame,base,0,0,10*two,k,k,k,k*a^2,1,1\n", "k.csv")
    path = write(
        """
        [model]
        tables = ["k.csv", "bodies.csv"]
        [parameters]
        k = 1e6
        a = 0.1
        two = 2
        [fixation.frame]
        """,
        "m.toml",
    )
    model = ibs.Model.from_toml(path)
    assert list(model.items) == ["frame", "mirror", "base"]
    assert model.connections["mount"].stiffness == pytest.approx((1e6, 1e6, 1e6, 1e4, 1, 1), rel=1e-14)
    assert model.connections["mount"].position1 == pytest.approx((0, 0, 0.02), rel=1e-14)
    model.to_toml(tmp_path / "written.toml")
    assert ibs.Model.from_toml(tmp_path / "written.toml") == model
    with pytest.raises(ibs.ModelFileError, match=r"\[model\] tables: '\.\./k\.csv' leads out of the folder"):
        ibs.Model.from_toml(write('[model]\ntables = "../k.csv"', "m.toml"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name,mas [g]\na,1\n", r"t\.csv: column 'mas' is not known\. Did you mean 'mass'"),
        ("name,mass [mm]\na,1\n", r"t\.csv: column 'mass \[mm\]': unit 'mm' is not one of mass"),
        ("name,kxx [N/m],item1\na,1,b\n", r"column 'kxx \[N/m\]': unit 'N/m' is not one of rotational stiffness"),
        ("name,mass [grm]\na,1\n", r"unit 'grm': 'grm' is not known"),
        ("name,mass,Mass\na,1,2\n", r"two columns are called 'mass'"),
        ("mass,x\n1,2\n", r"no component in it; a table has a heading with a column 'name'"),
        ("", "no component in it"),
        ("name,x,y,z\n,1,2,3\n", r"t\.csv: line 2: the name is missing"),
        ("name,x,y,z\n\na,1,,3\n", r"t\.csv: line 3 \(a\): position y is missing"),
        ("name,x,y,z\na,1,2,3,4\n", r"line 2 \(a\): '4' stands in a column without a heading"),
        ("name,x,y,z\na,1,2,q\n", r"line 2 \(a\) position: 'q': 'q' is not known"),
        ("name;x;y;z\na;0,5;1.234;0\n", r"line 2 \(a\) y: '1\.234' has a point where other cells have decimal commas"),
        ("name,kind\na,bodi\n", r"line 2: kind 'bodi' is not known\. Known: 'fixation'"),
        ("name,kx,item1,item2\nk,1,a,b\n", r"line 2 \(k\): ky, kz, kxx, kyy, kzz are missing; 0 leaves"),
        ("name,mass,cog x,cog y,cog z,Ixx,Iyy,Izz\na,-1,0,0,0,1,1,1\n", r"line 2 \(a\) .*mass must be above 0 kg"),
        ("name,x,y,z\na,0,0,0\na,1,1,1\n", r"line 3 \(a\) the name 'a' is taken"),
        ("name,inertia\na,3\n", "column 'inertia' is for 1-D models; a 3-D one takes Ixx, Iyy"),
        ("name,reduced\nf,../f.npz\n", r"line 2 \(f\) reduced: '\.\./f\.npz' leads out"),
        ("name,x\n\0", "is no text"),
        ('name,x\n"' + "a" * 200_000 + '"\n', "field larger than field limit"),
    ],
)
def test_errors_have_file_and_line_and_leave_the_model_as_it_was(write, text, words):
    model = ibs.Model("m")
    model.fixation("ground")
    before = model.copy()
    with pytest.raises(ibs.ModelFileError, match=words):
        model.add_table(write(text, "t.csv"))
    assert model == before


def test_an_unknown_kind_and_a_missing_file(tmp_path):
    with pytest.raises(ibs.ModelFileError, match="kind 'bodies' is not known"):
        ibs.Model("m").add_table(tmp_path / "t.csv", kind="bodies")
    with pytest.raises(FileNotFoundError, match=r"t\.csv does not exist"):
        ibs.Model("m").add_table(tmp_path / "t.csv")


@given(st.text(alphabet="name,;\t\n\"'0.5-=xyzkg[]mass#\r", max_size=120))
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_text_gives_components_or_an_error_in_words(tmp_path, text):
    path = tmp_path / "fuzz.csv"
    path.write_text(text, encoding="utf-8", newline="")
    model = ibs.Model("m")
    try:
        model.add_table(path)
    except ibs.ModelFileError as error:
        words = str(error)
    else:
        words = "fuzz.csv" if model.items else "nothing read and nothing said"
    assert "fuzz.csv" in words


# Factors by definition of the units, written out by hand.
@pytest.mark.parametrize(
    ("unit", "dimension", "factor"),
    [
        ("kg", "mass", 1.0),
        ("g", "mass", 1e-3),
        ("t", "mass", 1e3),
        ("lb", "mass", 0.45359237),
        ("mm", "length", 1e-3),
        ("µm", "length", 1e-6),
        ("μm", "length", 1e-6),
        ("um", "length", 1e-6),
        ("in", "length", 0.0254),
        ("kg mm^2", "inertia", 1e-6),
        ("g·mm²", "inertia", 1e-9),
        ("g*mm**2", "inertia", 1e-9),
        ("kgm2", "inertia", None),
        ("kg.m2", "inertia", 1.0),
        ("lb in^2", "inertia", 0.45359237 * 0.0254**2),
        ("N/m", "stiffness", 1.0),
        ("N/mm", "stiffness", 1e3),
        ("N mm^-1", "stiffness", 1e3),
        ("N/µm", "stiffness", 1e6),
        ("lbf/in", "stiffness", 4.4482216152605 / 0.0254),
        ("kg/s^2", "stiffness", 1.0),
        ("Nm/rad", "rotational stiffness", 1.0),
        ("N m", "rotational stiffness", 1.0),
        ("Nmm/deg", "rotational stiffness", 1e-3 * 180 / math.pi),
        ("kN m/mrad", "rotational stiffness", 1e6),
        ("N s/m", "damping", 1.0),
        ("Ns/mm", "damping", 1e3),
        ("Nm s/rad", "rotational damping", 1.0),
        ("%", "ratio", 1e-2),
        ("-", "ratio", 1.0),
        ("", "ratio", 1.0),
        ("N", "stiffness", None),
        ("mm²", "length", None),
        ("N//m", "stiffness", None),
        ("N/m]", "stiffness", None),
        ("^2", "length", None),
        ("mm^99", "length", None),
    ],
)
def test_units(unit, dimension, factor):
    if factor is None:
        with pytest.raises(ibs.ModelError, match="unit"):
            si_factor(unit, dimension)
    else:
        assert si_factor(unit, dimension) == pytest.approx(factor, rel=1e-15)
