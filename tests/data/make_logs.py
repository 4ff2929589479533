#!/usr/bin/env python3
"""Writes one record in every log format that Jointwatch reads, with the programs that usually write it.

The files are committed, so that the tests need no Python. To write them anew:

    pip install numpy scipy h5py nptdms asammdf pyuff openpyxl pyarrow
    python3 tests/data/make_logs.py
"""
import decimal
import gzip
import os
import pathlib

import numpy as np

HERE = pathlib.Path(__file__).parent / "logs"
ROWS, RATE = 500, 1000.0
NAMES = ["t_s", "x_m", "a_m_s2", "F_N"]
UNITS = ["s", "m", "m/s^2", "N"]


def record():
    """A mass of 2 kg on a spring of 9 kN/m with a damper of 20 N·s/m, driven by two sines; float64."""
    t = np.arange(ROWS) / RATE
    x = 1e-3 * np.sin(60.0 * t) + 4e-4 * np.sin(170.0 * t + 0.3)
    v = 6e-2 * np.cos(60.0 * t) + 6.8e-2 * np.cos(170.0 * t + 0.3)
    a = -3.6 * np.sin(60.0 * t) - 11.56 * np.sin(170.0 * t + 0.3)
    return [t, x, a, 2.0 * a + 20.0 * v + 9e3 * x]


def texts(columns):
    rows = list(zip(*columns))
    plain = ",".join(NAMES) + "\n" + "".join(",".join(repr(float(v)) for v in row) + "\n" for row in rows)
    (HERE / "record.csv").write_text(plain)
    # mtime = 0 keeps the bytes the same from run to run.
    (HERE / "record.csv.gz").write_bytes(gzip.compress(plain.encode(), mtime=0))
    german = "Messung;7;;\r\nDatum;14.03.2026;;\r\n\r\n" + ";".join(NAMES) + "\r\n" + ";".join(UNITS) + "\r\n"
    german += "".join(";".join(repr(float(v)).replace(".", ",") for v in row) + "\r\n" for row in rows)
    (HERE / "german.csv").write_bytes(german.encode("latin-1"))
    np.savetxt(HERE / "savetxt.txt", np.column_stack(columns), fmt="%.17g", header=" ".join(NAMES))


def workbook(columns):
    import openpyxl

    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Rig 4", None, None, None])
    sheet.append(NAMES)
    sheet.append(UNITS)
    for row in zip(*columns):
        sheet.append([float(v) for v in row])
    book.save(HERE / "record.xlsx")


def numpy_files(columns):
    np.savez_compressed(HERE / "record.npz", **dict(zip(NAMES, columns)))
    np.save(HERE / "matrix.npy", np.column_stack(columns))
    table = np.zeros(ROWS, dtype=[(name, "<f8") for name in NAMES])
    for name, column in zip(NAMES, columns):
        table[name] = column
    np.save(HERE / "structured.npy", table)


def matlab(columns):
    import h5py
    import scipy.io

    scipy.io.savemat(HERE / "record.mat", dict(zip(NAMES, columns)), do_compression=True)
    scipy.io.savemat(HERE / "matrix.mat", {"t_s": columns[0], "log": np.column_stack(columns[1:])}, do_compression=True)


    # As MATLAB's `save -v7.3` lays it out: 512 bytes of its own, each vector a row, in packed chunks.
    path = HERE / "v73.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, column in zip(NAMES, columns):
            data = file.create_dataset(name, data=column.reshape(1, -1), compression="gzip", chunks=(1, 250))
            data.attrs["MATLAB_class"] = np.bytes_("double")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, written by h5py".ljust(124) + b"\x00\x02IM")
    with h5py.File(HERE / "groups.h5", "w") as file:
        file["run/t_s"] = columns[0]
        file.create_dataset("run/log", data=np.column_stack(columns[1:]), chunks=(130, 2), compression="gzip", shuffle=True)


def mdf(columns):
    from asammdf import MDF, Signal

    for name, compression in (("record.mf4", 1), ("transposed.mf4", 2)):
        file = MDF(version="4.10")
        signals = [Signal(samples=c, timestamps=columns[0], name=n, unit=u) for n, u, c in zip(NAMES[1:], UNITS[1:], columns[1:])]
        file.append(signals, comment="rig 4")
        file.save(HERE / name, overwrite=True, compression=compression)


def labview(columns):
    from nptdms import ChannelObject, RootObject, TdmsWriter

    with TdmsWriter(HERE / "record.tdms") as writer:
        # Two segments, as a logger writes that flushes now and then.
        for part in (slice(0, 200), slice(200, None)):
            channels = [
                ChannelObject("run", name, column[part], properties={"unit_string": unit})
                for name, unit, column in zip(NAMES, UNITS, columns)
            ]
            writer.write_segment([RootObject(properties={"title": "rig 4"})] + channels)


def universal(columns):
    import pyuff

    for name, binary in (("ascii.uff", 0), ("binary.uff", 1)):
        path = HERE / name
        path.unlink(missing_ok=True)
        file = pyuff.UFF(str(path))
        for number, (label, unit, column) in enumerate(zip(NAMES[1:], UNITS[1:], columns[1:])):
            data = {
                "type": 58, "binary": binary, "func_type": 1, "ver_num": 0, "load_case_id": 0,
                "rsp_ent_name": label, "rsp_node": number + 1, "rsp_dir": 1,
                "ref_ent_name": "NONE", "ref_node": 0, "ref_dir": 0,
                "data": column, "x": columns[0], "id1": label, "id2": "rig 4", "id3": "NONE", "id4": "NONE", "id5": "NONE",
                "abscissa_spacing": 1, "abscissa_inc": 1.0 / RATE, "abscissa_min": 0.0, "num_pts": ROWS, "ord_data_type": 4,
                "abscissa_spec_data_type": 17, "abscissa_axis_lab": "Time", "abscissa_axis_units_lab": "s",
                "ordinate_spec_data_type": 8, "ordinate_axis_lab": label, "ordinate_axis_units_lab": unit,
                "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0, "z_axis_value": 0.0,
            }
            file.write_sets([data], "add")


def columnar(columns):
    import pyarrow as pa
    import pyarrow.feather
    import pyarrow.parquet

    fields = [pa.field(name, pa.float64(), metadata={"unit": unit}) for name, unit in zip(NAMES, UNITS)]
    table = pa.table([pa.array(column) for column in columns], schema=pa.schema(fields))
    # Two groups of rows, the second in several pages.
    pa.parquet.write_table(table, HERE / "record.parquet", row_group_size=300, data_page_size=1024)
    packings = dict(zip(NAMES, ("zstd", "gzip", "lz4", "none")))
    pa.parquet.write_table(table, HERE / "packed.parquet", compression=packings, use_dictionary=False)
    pa.feather.write_feather(table, HERE / "record.arrow", compression="lz4", chunksize=200)
    packed = pa.ipc.IpcWriteOptions(compression="zstd")
    with pa.OSFile(str(HERE / "stream.arrows"), "wb") as file, pa.ipc.new_stream(file, table.schema, options=packed) as stream:
        stream.write_table(table, max_chunksize=200)
    few = table.slice(0, 120)
    nanoseconds = 1_773_480_413_000_000_000 + np.arange(120) * 1_000_000
    types = {
        "t": pa.array(nanoseconds, pa.timestamp("ns", tz="UTC")),
        "x_m": few["x_m"], "a_m_s2": few["a_m_s2"], "F_N": few["F_N"],
        "gap": pa.array([None if i == 70 else float(i) for i in range(120)]),
        "count": pa.array(np.arange(120) + 2**31, pa.uint32()),
        "text": pa.array(["up", "down"] * 60).dictionary_encode(),
        "list": pa.array([[1.0, 2.0]] * 120),
        "nested": pa.array([{"inner": 1.0}] * 120),
        "nothing": pa.nulls(120),
        "decimal": pa.array([decimal.Decimal(i) for i in range(120)], pa.decimal128(10, 2)),
    }
    pa.parquet.write_table(pa.table(types), HERE / "types.parquet")
    pa.feather.write_feather(pa.table(types), HERE / "types.arrow", compression="zstd")


def main():
    HERE.mkdir(exist_ok=True)
    os.chdir(HERE)
    columns = record()
    for write in (texts, workbook, numpy_files, matlab, mdf, labview, universal, columnar):
        write(columns)
    for path in sorted(HERE.iterdir()):
        print(f"{path.stat().st_size:8} {path.name}")


if __name__ == "__main__":
    main()
