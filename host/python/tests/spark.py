"""Runs `jointwatch.spark` for real: PySpark in local mode, with an extension that is built already.

    python tests/spark.py LIBRARY PROGRAM FOLDER [ROWS]

LIBRARY is the extension as cargo built it, PROGRAM the command line to compare with. FOLDER keeps an environment with PySpark, from PyPI;
Java is Debian's (default-jre-headless). A worker is killed on the way. With ROWS, the rates of Spark and of two plain processes are
measured over so many rows. Where Java or PySpark cannot be had a line says SKIPPED, and why.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from pathlib import Path

HERE = Path(__file__).resolve().parent
NEEDED = ["numpy<3", "pandas<3", "pyarrow", "pyspark"]
STUDY = """
name = "fleet"
sample_rate_hz = 1000.0
{time}
axis = [{{ name = "x", kind = "translation", displacement = "d", force = "F", inertia = 0.0 }}]
record = [{{ file = "pilot.parquet", role = "train" }}]
base = {{ terms = ["stiffness@x", "viscous@x", "cubic_hardening@x"] }}
"""


def main() -> int:
    library, program, folder = (Path(word).resolve() for word in sys.argv[1:4])
    if shutil.which("java") is None:
        print("SKIPPED: there is no Java, so nobody tried Spark; install default-jre-headless")
        return 0
    python = folder / "spark-venv/bin/python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder / "spark-venv")], check=True)
    words = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *NEEDED]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        why = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
        print(f"SKIPPED: PySpark could not be installed, so nobody tried it: {' '.join(why)}")
        return 0
    with tempfile.TemporaryDirectory(dir=folder) as copy:
        package = Path(copy) / "python"
        shutil.copytree(HERE.parent / "python", package, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(library, package / "jointwatch" / "_native.abi3.so")
        variables = {
            "PYTHONPATH": str(package),
            "PYSPARK_PYTHON": str(python),
            "JOINTWATCH": str(program),
            "SPARK_LOCAL_IP": "127.0.0.1",
        }
        words = [str(python), str(Path(__file__).resolve()), "--inside", *sys.argv[4:5]]
        return subprocess.run(words, cwd=copy, env={**os.environ, **variables}).returncode


def log(rows: int, size: float, seed: int) -> dict:
    """Columns of a hardening spring with damping, and noise."""
    import numpy as np

    random = np.random.default_rng(seed)
    t = np.arange(rows) / 1000.0
    x, v = np.zeros(rows), np.zeros(rows)
    for k in range(12):
        w, phase = 2 * np.pi * (2 + 3 * k + random.uniform()), random.uniform(0, 2 * np.pi)
        a = size * random.uniform(1e-4, 4e-4)
        x += a * np.sin(w * t + phase)
        v += a * w * np.cos(w * t + phase)
    return {"t": t, "d": x, "F": 2e4 * x + 30 * v + 4e9 * x**3 + random.normal(0, 0.02, rows)}


def write(path: Path, columns: dict) -> str:
    import pyarrow as pa
    from pyarrow import parquet

    parquet.write_table(pa.table(columns), path)
    return str(path)


def session(master: str):
    from pyspark.sql import SparkSession

    made = (
        SparkSession.builder.master(master)
        .appName("jointwatch")
        .config("spark.ui.enabled", "false")
        .config("spark.sql.shuffle.partitions", "8")
        .config("spark.driver.host", "127.0.0.1")
        .config("spark.driver.memory", "2g")
        .getOrCreate()
    )
    made.sparkContext.setLogLevel("OFF")
    return made


def plain(here: Path, files: list, out: str, processes: int = 1) -> bytes:
    """The sums of plain processes, each with one thread, merged."""
    program = os.environ["JOINTWATCH"]
    running = []
    for k in range(processes):
        words = [program, "--threads", "1", "accumulate", "study.toml", *files[k::processes], "-o", f"{out}.{k}"]
        running.append(subprocess.Popen(words, cwd=here, stdout=subprocess.DEVNULL))
    assert [process.wait() for process in running] == [0] * processes
    words = [program, "merge", *(f"{out}.{k}" for k in range(processes)), "-o", out]
    subprocess.run(words, cwd=here, check=True, stdout=subprocess.DEVNULL)
    return (here / out).read_bytes()


def children(of: int) -> list:
    """The processes that a process started, and those that they started."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            except OSError:
                continue
            if parent == of:
                found += [int(entry.name), *children(int(entry.name))]
    return found


def kill_a_worker(killed: list, stop: threading.Event) -> None:
    """Kills one Python worker of this session while it works."""
    while not stop.is_set():
        for pid in children(os.getpid()):
            try:
                words = Path(f"/proc/{pid}/cmdline").read_text()
                parent = int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
                busy = sum(int(n) for n in Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13])
                of_daemon = "pyspark.daemon" in Path(f"/proc/{parent}/cmdline").read_text()
            except OSError:
                continue
            if "pyspark.daemon" in words and of_daemon and busy > 20:
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
                return
        time.sleep(0.02)


def check(here: Path) -> None:
    from jointwatch import DataError, Study, Sums, spark

    (here / "study.toml").write_text(STUDY.format(time='time = "t"'))
    write(here / "pilot.parquet", log(20_000, 1.0, 1))
    files = [write(here / f"log{k}.parquet", log(200_000 + 1000 * k, 0.5 + 0.1 * k, 10 + k)) for k in range(8)]
    study = Study.open(here / "study.toml")
    one = plain(here, files, "one.acc")
    assert one == plain(here, files[::-1], "two.acc", 2), "two processes give other bytes than one"
    assert bytes(Sums.of_files(study, files)) == one, "Python gives other bytes than the command line"

    engine = session("local[2,4]")
    paths = engine.createDataFrame([(path,) for path in files], "path string").repartition(4)
    killed, stop = [], threading.Event()
    killer = threading.Thread(target=kill_a_worker, args=(killed, stop))
    killer.start()
    sums = spark.accumulate(paths, study, path="path")
    stop.set()
    killer.join()
    assert bytes(sums) == one, "Spark gives other bytes than one process"
    print(f"files by path: the same bytes, {len(killed)} worker killed on the way")
    assert killed, "no worker was busy long enough to be killed"

    # The rows themselves, shuffled: known by their own hashes, so compared with one process that sums the same arrays.
    import numpy as np
    import pyarrow.parquet as pq
    from jointwatch import _native
    from jointwatch._sums import merge_bytes, plan_of
    from pyspark.sql import functions as f

    some = files[:3]
    frame = engine.read.parquet(*some).withColumn("record", f.element_at(f.split(f.input_file_name(), "/"), -1))
    frame = frame.orderBy(f.rand(seed=4))
    plan: _native.Plan = plan_of(study)
    parts = []
    for path in some:
        table = pq.read_table(path)
        columns = [(name, np.ascontiguousarray(table[name].to_numpy())) for name in plan.columns()[0]]
        parts.append((path, plan.sum_log((Path(path).name, columns))))
    shuffled = spark.accumulate(frame, study, record="record")
    assert bytes(shuffled) == bytes(merge_bytes(parts)), "shuffled rows give other bytes than their arrays"
    print("rows in any order: the same bytes")

    model = sums.identify("physical", study=study)
    scored = {row.record: row for row in spark.score(paths, model, study, path="path").collect()}
    program = os.environ["JOINTWATCH"]
    model.save(here / "model.json")
    for path in some:
        name = Path(path).name
        text = STUDY.format(time='time = "t"').replace("pilot.parquet", name)
        (here / "single.toml").write_text(text)
        words = [program, "compare", "single.toml", "model.json", "--json", "-"]
        told = json.loads(subprocess.run(words, cwd=here, check=True, capture_output=True, text=True).stdout)
        assert scored[path].nmse_percent == told["records"][0]["axes"]["x"]["nmse_percent"], name
    print("score: the figures of compare")

    bad = here / "bad.parquet"
    # Where a page of the second group of rows begins, nothing is.
    pq.write_table(pq.read_table(files[0]), bad, row_group_size=50_000)
    at = pq.ParquetFile(bad).metadata.row_group(1).column(1).data_page_offset
    whole = bad.read_bytes()
    bad.write_bytes(whole[:at] + bytes(16) + whole[at + 16 :])
    mixed = engine.createDataFrame([(path,) for path in [*files, str(bad)]], "path string").repartition(4)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        left = spark.accumulate(mixed, study, path="path", on_bad="skip")
    assert bytes(left) == one, "a corrupt file changes the sums of the others"
    sentences = [str(warning.message) for warning in told if "left out" in str(warning.message)]
    assert len(sentences) == 1 and "bad.parquet" in sentences[0] and "row group 2" in sentences[0], sentences
    print(f"a corrupt file: {sentences[0]}")
    try:
        spark.accumulate(mixed, study, path="path")
    except Exception as problem:
        assert "bad.parquet" in str(problem), problem
    else:
        raise AssertionError("a corrupt file was taken")
    try:
        spark.accumulate(paths.union(paths), study, path="path")
    except (DataError, Exception) as problem:
        assert "counted already" in str(problem), problem
    else:
        raise AssertionError("files that are there twice were counted twice")
    print("a corrupt file without skip, and files given twice: refused")
    engine.stop()


def measure(here: Path, rows: int) -> None:
    from jointwatch import Study, spark

    (here / "study.toml").write_text(STUDY.format(time=""))
    write(here / "pilot.parquet", {k: v for k, v in log(20_000, 1.0, 1).items() if k != "t"})
    each = 500_000
    files = []
    for k in range(rows // each):
        columns = {name: values for name, values in log(each, 0.9, 10 + k).items() if name != "t"}
        files.append(write(here / f"part{k}.parquet", columns))
    study = Study.open(here / "study.toml")
    start = time.monotonic()
    one = plain(here, files, "plain.acc", 2)
    plainly = time.monotonic() - start
    engine = session("local[2,4]")
    paths = engine.createDataFrame([(path,) for path in files], "path string").repartition(8)
    paths.count()
    start = time.monotonic()
    sums = spark.accumulate(paths, study, path="path")
    sparkly = time.monotonic() - start
    assert bytes(sums) == one
    total = each * len(files)
    print(
        f"{total:.1e} rows in {len(files)} files: two plain processes {total / plainly / 1e6:.2f} M rows/s, "
        f"Spark local[2] {total / sparkly / 1e6:.2f} M rows/s, {100 * plainly / sparkly:.0f} %"
    )
    engine.stop()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--inside"]:
        with tempfile.TemporaryDirectory() as made:
            check(Path(made)) if len(sys.argv) < 3 else measure(Path(made), int(float(sys.argv[2])))
    else:
        sys.exit(main())
