"""Measured records: every format to the same record, and what is wrong with a file said in words."""

import struct
import sys
import zipfile

import numpy as np
import pytest
from scipy.io import savemat, wavfile

import ibsdyn as ibs

RATE = 2048.0
TIME = np.arange(400) / RATE
U1 = np.sin(2 * np.pi * 31 * TIME) + 0.1 * np.cos(2 * np.pi * 77 * TIME)
Y1 = 3 * np.cos(2 * np.pi * 50 * TIME)
TABLE = {"U1": "g", "Y1": "m/s²"}


def _same(record, rtol=1e-12, rate=RATE):
    assert record.names == ("U1", "Y1")
    assert record.units == ("m/s²", "m/s²")
    assert record.sample_rate == rate
    np.testing.assert_allclose(record["U1"], 9.80665 * U1, rtol=rtol, atol=10 * rtol)
    np.testing.assert_allclose(record["Y1"], Y1, rtol=rtol, atol=10 * rtol)


def _text(path, header, rows, delimiter=",", decimal=".", digits=17):
    lines = [delimiter.join(f"{v:.{digits}g}".replace(".", decimal) for v in row) for row in rows]
    path.write_text(header + "\n".join(lines) + "\n", encoding="utf-8")
    return path


# --- formats ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "delimiter", "decimal"),
    [
        ("time [s],U1 [g],Y1 [m/s^2]\n", ",", "."),
        ("Logger 3000\nrun;7\n\nTime (s);U1 (g);Y1 (m/s2)\n", ";", ","),
        ("# test\n# t  U1  Y1\n", "  ", "."),
        ("t\tU1\tY1\n[s]\t[g]\t[m/s**2]\n", "\t", ","),
        ("Time,U1,Y1\ns,g,m/s2\n", ",", "."),
    ],
)
def test_csv_dialects(tmp_path, header, delimiter, decimal):
    path = _text(tmp_path / "a.csv", header, np.column_stack([TIME, U1, Y1]), delimiter, decimal)
    _same(ibs.read_record(path, channels=TABLE if header.startswith("#") else None))


def test_csv_without_titles_takes_the_table_in_order(tmp_path):
    path = _text(tmp_path / "a.txt", "", np.column_stack([U1, Y1]))
    _same(ibs.read_record(path, channels=TABLE, sample_rate=RATE))
    with pytest.raises(ibs.RecordError, match="give sample_rate="):
        ibs.read_record(path, channels=TABLE)


def test_csv_may_announce_its_rate_and_print_time_coarsely(tmp_path):
    path = _text(tmp_path / "a.csv", "Sampling frequency [Hz]: 2048\nU1,Y1\n", np.column_stack([U1, Y1]))
    _same(ibs.read_record(path, channels=TABLE))
    rows = np.column_stack([1000 * np.round(TIME, 5), U1, Y1])
    record = ibs.read_record(_text(tmp_path / "b.csv", "time [ms],U1,Y1\n", rows), channels=TABLE)
    _same(record)


def test_mat_files_of_both_versions(tmp_path):
    savemat(tmp_path / "a.mat", {"Fs": RATE, "U1": U1, "Y1": Y1[:, None], "note": "run 1"})
    _same(ibs.read_record(tmp_path / "a.mat", channels=TABLE))
    savemat(tmp_path / "b.mat", {"t": TIME, "data": np.column_stack([Y1, U1])})
    table = [ibs.Channel("U1", "data[1]", "g"), ibs.Channel("Y1", 0, "m/s²")]
    _same(ibs.read_record(tmp_path / "b.mat", channels=table))
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "c.mat", "w", userblock_size=512) as file:
        file["Fs"], file["U1"], file["Y1"] = [[RATE]], U1[None], Y1[:, None]
        file["note"] = np.array([[114], [117]], dtype=np.uint16)
        file["note"].attrs["MATLAB_class"] = np.bytes_("char")
    _same(ibs.read_record(tmp_path / "c.mat", channels=TABLE))


def test_npz_with_names_and_units_needs_no_table(tmp_path):
    np.savez(tmp_path / "a.npz", signals=[U1, Y1], names=["U1", "Y1"], units=["g", "m/s^2"], dt=1 / RATE, start=0.5)
    record = ibs.read_record(tmp_path / "a.npz", period=200, title="run 1")
    _same(record)
    assert (record.start, record.period, record.title) == (0.5, 200, "run 1")


def test_npz_is_never_unpickled(tmp_path):
    np.savez(tmp_path / "a.npz", fs=RATE, data=np.array([{"a": 1}, None], dtype=object))
    with pytest.raises(ibs.RecordError, match=r"cannot be read as NPZ .*plain arrays of numbers"):
        ibs.read_record(tmp_path / "a.npz")


def test_hdf5_with_attributes_needs_no_table(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, values, unit in (("run/U1", U1, "g"), ("run/Y1", Y1, "m/s²")):
            file[name] = values
            file[name].attrs.update({"unit": unit, "sample_rate": RATE})
    record = ibs.read_record(tmp_path / "a.h5", channels=[ibs.Channel("U1", "run/U1"), ibs.Channel("Y1", "run/Y1")])
    _same(record)
    assert ibs.read_record(tmp_path / "a.h5").names == ("run/U1", "run/Y1")


@pytest.mark.parametrize(("kind", "bits"), [("int16", 16), ("int32", 32), ("float32", 24)])
def test_wav_in_fractions_of_full_scale(tmp_path, kind, bits):
    values = np.column_stack([U1, Y1]) / 8
    stored = values.astype(kind) if kind == "float32" else np.round(values * 2.0 ** (bits - 1)).astype(kind)
    wavfile.write(tmp_path / "a.wav", int(RATE), stored)
    table = [ibs.Channel("U1", "channel 1", "g", scale=8.0), ibs.Channel("Y1", "channel 2", "m/s²", scale=8.0)]
    _same(ibs.read_record(tmp_path / "a.wav", channels=table), rtol=20 * 2.0**-bits)
    assert set(ibs.read_record(tmp_path / "a.wav").units) == {"-"}


def _uff(path, sets):
    """Data sets 58 written by hand, ASCII double precision, after the format's published description."""
    lines = []
    for label, node, direction, unit, step, values, kind in sets:
        lines += ["    -1", "    58", "id", "NONE", "01-Jan-26 12:00:00", "NONE", "NONE"]
        lines += [f"{kind:5d}{1:10d}{0:5d}{0:10d} {label:<10s}{node:10d}{direction:4d} {'NONE':<10s}{0:10d}{0:4d}"]
        lines += [f"{4:10d}{len(values):10d}{1:10d}{0:13.5e}{step:13.5e}{0:13.5e}"]
        lines += [f"{17:10d}{0:5d}{0:5d}{0:5d} {'time':<20s} {'s':<20s}"]
        lines += [f"{12:10d}{0:5d}{0:5d}{0:5d} {'Acceleration':<20s} {unit:<20s}"]
        lines += [f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20s} {'NONE':<20s}"] * 2
        lines += ["".join(f"{v:20.11e}" for v in values[i : i + 4]) for i in range(0, len(values), 4)]
        lines += ["    -1"]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_uff_58(tmp_path):
    pytest.importorskip("pyuff", reason='extra: pip install "ibsdyn[uff]"')
    path = _uff(tmp_path / "a.uff", [("cube", 1, 3, "g", 1 / RATE, U1, 1), ("mirror", 7, -1, "m/s^2", 1 / RATE, Y1, 1)])
    table = [ibs.Channel("U1", "cube:1+Z"), ibs.Channel("Y1", "mirror:7-X")]
    _same(ibs.read_record(path, channels=table), rtol=1e-11)
    other = _uff(tmp_path / "b.uff", [("a", 1, 1, "g", 1 / RATE, U1, 1), ("b", 2, 1, "g", 2 / RATE, Y1, 1)])
    with pytest.raises(ibs.RecordError, match=r"'a:1\+X' is sampled at 2048 Hz, 'b:2\+X' at 1024 Hz"):
        ibs.read_record(other)
    spectra = _uff(tmp_path / "c.uff", [("a", 1, 1, "g", 1.0, U1, 4)])
    with pytest.raises(ibs.RecordError, match="no time responses but FRF"):
        ibs.read_record(spectra)
    whole = path.read_text().splitlines()
    (tmp_path / "d.uff").write_text("\n".join([*whole[:60], "    -1"]) + "\n")
    with pytest.raises(ibs.RecordError, match="announces 400 samples and has 1"):
        ibs.read_record(tmp_path / "d.uff")


@pytest.mark.parametrize("name", ["Sample_UFF58_ascii.uff", "Sample_UFF58b_bin.uff"])
def test_real_universal_files(shared, name):
    pytest.importorskip("pyuff", reason='extra: pip install "ibsdyn[uff]"')
    path = shared / "data" / "uff" / name
    if not path.is_file():
        pytest.skip(f"{path} is not on this machine")
    record = ibs.read_record(path)
    # a microphone, 65.536 kHz; the first numbers as they are printed in the ASCII file
    assert record.sample_rate == 65536.0
    assert record.n_samples == 79292
    assert record.units == ("Pa",)
    np.testing.assert_allclose(record.signals[0, :3], [-1.47553e-2, -1.72957e-2, -1.66101e-2], rtol=1e-5)


@pytest.mark.parametrize(("module", "name", "extra"), [("pyuff", "a.uff", "uff"), ("h5py", "a.h5", "hdf5")])
def test_a_missing_extra_is_named(tmp_path, monkeypatch, module, name, extra):
    (tmp_path / name).write_bytes(b"    -1\n    58\n" if extra == "uff" else b"\x89HDF\r\n\x1a\n" + bytes(100))
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ibs.ExtraMissingError, match=rf'needs {module}: pip install "ibsdyn\[{extra}\]"'):
        ibs.read_record(tmp_path / name)


# --- the channel table -----------------------------------------------------------------------------------------------


def test_sensitivity_and_scale_make_accelerations_of_volts(tmp_path):
    path = _text(tmp_path / "a.csv", "t,AI0 [mV],AI1 [V]\n", np.column_stack([TIME, 102.3 * U1, -0.5 * Y1]))
    table = tmp_path / "channels.csv"
    table.write_text(
        "Name;Column;Unit;Scale;Sensitivity\nU1;AI0;;;102.3 mV/g\nY1;1;V;-10;5 V/(m/s²)\n", encoding="utf-8"
    )
    _same(ibs.read_record(path, channels=table))
    wrong = [ibs.Channel("U1", "AI0", unit="g", sensitivity="102.3 mV/g")]
    with pytest.raises(ibs.RecordError, match="numbers are in 'g'; they must be in V or a multiple"):
        ibs.read_record(path, channels=wrong)


def test_unknown_units_are_kept_and_missing_ones_asked_for(tmp_path):
    path = _text(tmp_path / "a.csv", "t,U1 [furlong],Y1\n", np.column_stack([TIME, U1, Y1]))
    with pytest.warns(ibs.RecordWarning, match="'furlong' is not known and kept") as seen:
        record = ibs.read_record(path, channels=[ibs.Channel("U1")])
    assert record.units == ("furlong",)
    assert seen[0].filename == __file__
    with pytest.raises(ibs.RecordError, match="channel 'Y1': neither the file nor the channel table says its unit"):
        ibs.read_record(path, channels=[ibs.Channel("Y1")])


@pytest.mark.parametrize(
    ("channels", "words"),
    [
        ({"a": "g", "b": "g", "c": "g"}, r"has 2 columns \['U1', 'Y1'\], the channel table 3 channels"),
        ([ibs.Channel("Y", "Y2", "g")], "no column 'Y2'.*Did you mean 'Y1'"),
        ([ibs.Channel("Y", 2, "g")], "2 columns, numbered 0 to 1 .* asks for column 2"),
        ([ibs.Channel("a", 0, "g"), ibs.Channel("b", "U1", "g")], "'U1' is taken for two channels"),
        ([ibs.Channel("a", 0, "g"), ibs.Channel("a", 1, "g")], "2 channels 'a'"),
        ([], "table is empty"),
    ],
)
def test_tables_that_do_not_fit(tmp_path, channels, words):
    path = _text(tmp_path / "a.csv", "t,U1,Y1\n", np.column_stack([TIME, U1, Y1]))
    with pytest.raises(ibs.IbsdynError, match=words):
        ibs.read_record(path, channels=channels)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"name": " "}, "non-empty text"),
        ({"name": "a", "column": 1.5}, "label or a number"),
        ({"name": "a", "scale": 0.0}, "scale is zero"),
        ({"name": "a", "sensitivity": "100 mV"}, r"as '102.3 mV/g'"),
        ({"name": "a", "sensitivity": "0 mV/g"}, r"as '102.3 mV/g'"),
        ({"name": "a", "sensitivity": 100}, "must be a text"),
    ],
)
def test_channels_that_cannot_be(given, words):
    with pytest.raises(ibs.RecordError, match=words):
        ibs.Channel(**given)


def test_a_table_with_a_wrong_title_answers_with_the_nearest(tmp_path):
    table = tmp_path / "channels.csv"
    table.write_text("name,colum\nU1,0\n")
    path = _text(tmp_path / "a.csv", "t,U1,Y1\n", np.column_stack([TIME, U1, Y1]))
    with pytest.raises(ibs.RecordError, match=r"title 'colum' is not known. Did you mean 'column'"):
        ibs.read_record(path, channels=table)


# --- what is wrong with a record -------------------------------------------------------------------------------------


def test_clipped_and_dead_channels_are_told(tmp_path):
    rows = np.column_stack([TIME, np.clip(U1, -0.8, 0.9), 0 * Y1])
    with pytest.warns(ibs.RecordWarning) as seen:
        ibs.read_record(_text(tmp_path / "a.csv", "t,U1,Y1\n", rows), channels=TABLE)
    words = [str(warning.message) for warning in seen]
    # 6 whole periods of 31 Hz: the signal is cut once a period
    assert "channel 'U1' stays at its extreme value -0.8 (as recorded) in 6 places" in words[0]
    assert "channel 'Y1' is constant (0)" in words[1]


@pytest.mark.parametrize("code", [2.0**-4, 2.0**-8, 2.0**-15])
def test_a_coarse_converter_is_not_taken_for_clipping(tmp_path, code, recwarn):
    slow = np.sin(2 * np.pi * 5.3 * np.arange(4000) / RATE)  # stays long at its top code
    np.savez(tmp_path / "a.npz", fs=RATE, U1=code * np.round(slow / code))
    ibs.read_record(tmp_path / "a.npz", channels={"U1": "g"})
    assert not recwarn.list


def test_a_time_column_with_a_gap_or_a_wrong_rate_is_refused(tmp_path):
    rows = np.delete(np.column_stack([TIME, U1, Y1]), 123, axis=0)
    path = _text(tmp_path / "a.csv", "t,U1,Y1\n", rows, digits=6)
    with pytest.raises(ibs.RecordError, match=r"not equidistant: .* after sample 122 .*Samples are lost"):
        ibs.read_record(path, channels=TABLE)
    assert ibs.read_record(path, channels=TABLE, time=False, sample_rate=RATE).n_samples == 399
    whole = _text(tmp_path / "b.csv", "t,U1,Y1\n", np.column_stack([TIME, U1, Y1]))
    with pytest.raises(ibs.RecordError, match="sampled at 2048 Hz by its own account, but sample_rate=1024"):
        ibs.read_record(whole, channels=TABLE, sample_rate=1024.0)
    with pytest.raises(ibs.RecordError, match="does not rise"):
        ibs.read_record(_text(tmp_path / "c.csv", "t,U1\n", np.column_stack([-TIME, U1])), channels={"U1": "g"})


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("Sample rate: 51.2 kHz", 51200.0),
        ("Sampling frequency [kHz]: 51.2", 51200.0),
        ("Sample rate;51,2 kS/s", 51200.0),
        ("fs = 1.5 MSa/s", 1.5e6),
        ("Sampling rate: 51 200 Hz", 51200.0),
        ("Sample rate: 51,200.5 Hz", 51200.5),
        ("Sample rate: 1.048.576,0 Hz", 1048576.0),
        ("Sample rate: 2.048e3", 2048.0),
        ("Sample rate: 51,200 Hz", None),  # 51.2 or fifty-one thousand?
        ("Sample rate: 51,200 kHz", None),
    ],
)
def test_an_announced_rate_is_understood_with_its_prefix_or_asked_for(tmp_path, line, rate):
    path = _text(tmp_path / "a.csv", f"{line}\nU1;Y1\n", np.column_stack([U1, Y1]), delimiter=";")
    if rate is not None:
        assert ibs.read_record(path, channels=TABLE).sample_rate == rate
        return
    with pytest.raises(ibs.RecordError, match="give sample_rate="):
        ibs.read_record(path, channels=TABLE)
    assert ibs.read_record(path, channels=TABLE, sample_rate=RATE).sample_rate == RATE


def test_what_a_file_says_twice_must_agree(tmp_path):
    path = _text(tmp_path / "a.csv", "sample rate: 1000 Hz\nt,U1,Y1\n", np.column_stack([TIME, U1, Y1]))
    with pytest.warns(ibs.RecordWarning, match=r"those of 2048 Hz, its header says 1000 Hz; the times are taken"):
        _same(ibs.read_record(path, channels=TABLE))
    np.savez(tmp_path / "b.npz", t=TIME, fs=500.0, U1=U1, Y1=Y1)
    with pytest.warns(ibs.RecordWarning, match="those of 2048 Hz, its scalar rate or step says 500 Hz"):
        _same(ibs.read_record(tmp_path / "b.npz", channels=TABLE))
    for wrong, words in (
        ({"fs": RATE, "dt": 1e-3}, "2048 Hz and its step of 0.001 s contradict"),
        ({"t": TIME[:-1]}, r"399 times, which fit none of the arrays: 'U1' \(400,\)"),
        ({"fs": -5.0}, "sample rate of -5 Hz is none"),
        ({"fs": RATE, "period": 40.7}, "period of 40.7 is no whole number"),
        ({"fs": RATE, "period": np.nan}, "period of nan is no whole number"),
    ):
        np.savez(tmp_path / "c.npz", U1=U1, Y1=Y1, **wrong)
        with pytest.raises(ibs.RecordError, match=words):
            ibs.read_record(tmp_path / "c.npz", channels=TABLE)


def test_gaps_and_unequal_lengths(tmp_path):
    values = U1.copy()
    values[7] = np.nan
    path = _text(tmp_path / "a.csv", "t,U1\n", np.column_stack([TIME, values]))
    with pytest.raises(ibs.RecordError, match=r"'U1' is nan at sample 7 "):
        ibs.read_record(path, channels={"U1": "g"})
    np.savez(tmp_path / "b.npz", fs=RATE, U1=U1, Y1=Y1[:-1])
    with pytest.raises(ibs.RecordError, match=r"unequal numbers of samples: 'U1' 400, 'Y1' 399"):
        ibs.read_record(tmp_path / "b.npz", channels=TABLE)
    lines = _text(tmp_path / "c.csv", "t,U1\n", np.column_stack([TIME, U1])).read_text().splitlines()
    (tmp_path / "d.csv").write_text("\n".join([*lines[:50], "0.1,", *lines[51:]]))
    with pytest.raises(ibs.RecordError, match="line 51 has 1 cells, the first line of numbers 2"):
        ibs.read_record(tmp_path / "d.csv", channels={"U1": "g"})
    (tmp_path / "e.csv").write_text("\n".join([*lines[:50], "0.1,overload", *lines[51:]]))
    with pytest.raises(ibs.RecordError, match="line 51, column 2: 'overload' is not a number"):
        ibs.read_record(tmp_path / "e.csv", channels={"U1": "g"})


def test_files_that_are_not_there_or_no_records(tmp_path):
    with pytest.raises(FileNotFoundError, match="does not exist"):
        ibs.read_record(tmp_path / "none.csv")
    with pytest.raises(ibs.RecordError, match="is not a file"):
        ibs.read_record(tmp_path)
    with pytest.raises(ibs.RecordError, match="got None"):
        ibs.read_record(None)
    for content, words in (
        (b"", "is empty"),
        (b"nothing but words\nand more\n", "no table of numbers"),
        (b"\x00\x01\x02\x03" * 50, "no text and none of the binary formats"),
    ):
        (tmp_path / "a.dat").write_bytes(content)
        with pytest.raises(ibs.RecordError, match=words):
            ibs.read_record(tmp_path / "a.dat")
    savemat(tmp_path / "b.mat", {"Fs": RATE})
    with pytest.raises(ibs.RecordError, match="no array of samples; it holds Fs"):
        ibs.read_record(tmp_path / "b.mat")
    np.savez(tmp_path / "c.npz", fs=RATE, U1=U1 * 1j)
    with pytest.raises(ibs.RecordError, match="is complex"):
        ibs.read_record(tmp_path / "c.npz")


def test_truncated_and_hostile_files(tmp_path, monkeypatch):
    monkeypatch.setattr("ibsdyn.records.file_bytes._HARMLESS", 1 << 20)
    wavfile.write(tmp_path / "a.wav", int(RATE), (1000 * U1).astype(np.int16))
    content = (tmp_path / "a.wav").read_bytes()
    (tmp_path / "b.wav").write_bytes(content[:-100])
    with pytest.raises(ibs.RecordError, match="announces 800 bytes of samples and has 700"):
        ibs.read_record(tmp_path / "b.wav")
    (tmp_path / "c.wav").write_bytes(content[:40] + struct.pack("<I", 2**32 - 8) + content[44:])
    with pytest.raises(ibs.RecordError, match="announces 4294967288 bytes"):
        ibs.read_record(tmp_path / "c.wav")
    with (
        zipfile.ZipFile(tmp_path / "d.npz", "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("U1.npy", "w") as member,
    ):
        np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": (1 << 19,)})
        member.write(bytes(1 << 22))
    with pytest.raises(ibs.RecordError, match="far more than a record of its size"):
        ibs.read_record(tmp_path / "d.npz")
    np.savez(tmp_path / "e.npz", fs=RATE, U1=U1)
    (tmp_path / "e.npz").write_bytes((tmp_path / "e.npz").read_bytes()[:1000])
    with pytest.raises(ibs.RecordError, match="cannot be read as NPZ"):
        ibs.read_record(tmp_path / "e.npz")
    savemat(tmp_path / "f.mat", {"Fs": RATE, "U1": U1})
    (tmp_path / "f.mat").write_bytes((tmp_path / "f.mat").read_bytes()[:1000])
    with pytest.raises(ibs.RecordError, match="truncated"):
        ibs.read_record(tmp_path / "f.mat")
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "g.h5", "w") as file:
        file.create_dataset("U1", shape=(1 << 36,), dtype="f8", chunks=True, compression="gzip")
    with pytest.raises(ibs.RecordError, match="far more than the file holds"):
        ibs.read_record(tmp_path / "g.h5")


# --- what we write ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".npz", ".csv"])
def test_a_written_record_is_read_back_as_it_was(tmp_path, suffix):
    path = tmp_path / f"run{suffix}"
    record = ibs.TimeRecord(
        [U1, Y1], ["platform.z acceleration", "Y1"], ["m/s²", "rad"], RATE, start=0.25, period=100, title="run"
    )
    ibs.write_record(record, path)
    again = ibs.read_record(path)
    assert (again.names, again.units) == (record.names, record.units)
    np.testing.assert_array_equal(again.signals, record.signals)
    assert again.start == record.start
    assert again.sample_rate == pytest.approx(RATE, rel=1e-12)
    assert again.period == (100 if suffix == ".npz" else None)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_a_record_that_cannot_be_written_leaves_nothing(tmp_path):
    record = ibs.TimeRecord([U1], ["a;b"], ["m"], RATE)
    for name, words in (("run.xlsx", r"one of \.npz, \.csv"), ("run.csv", "cannot stand in a title")):
        with pytest.raises(ibs.RecordError, match=words):
            ibs.write_record(record, tmp_path / name)
    assert not list(tmp_path.iterdir())
