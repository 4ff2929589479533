#!/usr/bin/env python3
"""Writes one record in every log format that Jointwatch reads, with the programs that usually write it.

The files are committed, so that the tests need no Python. To write them anew:

    pip install numpy scipy nptdms pyuff openpyxl
    python3 tests/data/make_logs.py
"""
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
    import scipy.io

    scipy.io.savemat(HERE / "record.mat", dict(zip(NAMES, columns)), do_compression=True)
    scipy.io.savemat(HERE / "matrix.mat", {"t_s": columns[0], "log": np.column_stack(columns[1:])}, do_compression=True)


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


def main():
    HERE.mkdir(exist_ok=True)
    os.chdir(HERE)
    columns = record()
    for write in (texts, workbook, numpy_files, matlab, labview, universal):
        write(columns)
    for path in sorted(HERE.iterdir()):
        print(f"{path.stat().st_size:8} {path.name}")


if __name__ == "__main__":
    main()
