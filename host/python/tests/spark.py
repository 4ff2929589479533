"""Runs `jointwatch.spark` for real: PySpark in local mode, with an extension that is built already.

    python tests/spark.py LIBRARY PROGRAM FOLDER [ROWS]

LIBRARY is the extension as cargo built it, PROGRAM the command line to compare with. FOLDER keeps an environment with PySpark, from PyPI;
Java is Debian's (default-jre-headless). A Python worker is killed on the way, and in a cluster of two JVMs one of them. With ROWS, the
rates of Spark and of two plain processes are measured over so many rows. Where Java or PySpark cannot be had a line says SKIPPED, and why.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from pathlib import Path
from typing import Any, Callable

from environment import environment, with_package

TURNS = 3
NEEDED = ["numpy<3", "pandas<3", "pyarrow", "pyspark"]
STUDY = """
name = "fleet"
sample_rate_hz = 1000.0
{time}
axis = [{{ name = "x", kind = "translation", displacement = "d", force = "F", inertia = 0.0 }}]
record = [{{ file = "pilot.parquet", role = "train" }}]
base = {{ terms = ["stiffness@x", "viscous@x", "cubic_hardening@x"] }}
"""


def in_environment(script: str, needed: list, words: list) -> int:
    """Runs a script with --inside, in an environment that has what it needs, with a copy of the package."""
    library, program, folder = (Path(word).resolve() for word in words[:3])
    folder.mkdir(parents=True, exist_ok=True)
    python = environment(folder / "spark-venv", needed)
    with with_package(library, program, folder) as (copy, variables):
        variables["PYSPARK_PYTHON"] = str(python)
        variables["SPARK_LOCAL_IP"] = "127.0.0.1"
        # Where the executors of a cluster keep what they print, which is the package's own folder otherwise.
        variables["SPARK_WORKER_DIR"] = str(copy / "work")
        told = [str(python), script, "--inside", *words[3:4]]
        return subprocess.run(told, cwd=copy, env=variables).returncode


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


def ancestors(pid: int) -> list:
    """The processes between a process and this one, itself first, with their command lines; nothing where it is no descendant."""
    line = []
    while pid > 1:
        if pid == os.getpid():
            return line
        line.append((pid, Path(f"/proc/{pid}/cmdline").read_text()))
        pid = int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
    return []


def kill_one(what: str, killed: list, stop: threading.Event) -> None:
    """Kills one Python worker of this session that has begun to sum, or the executor that it works for."""
    while not stop.wait(0.02):
        for entry in Path("/proc").iterdir():
            try:
                line = ancestors(int(entry.name)) if entry.name.isdigit() else []
                # A worker is forked from a daemon that has not loaded the extension.
                if not line or "pyspark.daemon" not in line[0][1] or "_native" not in (entry / "maps").read_text():
                    continue
            except OSError:
                continue
            executors = [pid for pid, words in line if "CoarseGrainedExecutorBackend" in words]
            for pid in [line[0][0]] if what == "worker" else executors:
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
                return


def killing(what: str, work: Callable[[], Any]) -> Any:
    """The result of some work, during which a worker or an executor was killed; done again where it was over before one was seen."""
    for _ in range(TURNS):
        killed, stop = [], threading.Event()
        killer = threading.Thread(target=kill_one, args=(what, killed, stop))
        killer.start()
        try:
            result = work()
        finally:
            stop.set()
            killer.join()
        assert len(killed) < 2, f"{len(killed)} were killed where one {what} was to be"
        if killed:
            return result
    raise AssertionError(f"no {what} was seen at work, so none was killed")


def check(here: Path) -> None:
    from jointwatch import Study, Sums, spark

    (here / "study.toml").write_text(STUDY.format(time='time = "t"'))
    write(here / "pilot.parquet", log(20_000, 1.0, 1))
    files = [write(here / f"log{k}.parquet", log(200_000 + 1000 * k, 0.5 + 0.1 * k, 10 + k)) for k in range(8)]
    study = Study.open(here / "study.toml")
    one = plain(here, files, "one.acc")
    assert one == plain(here, files[::-1], "two.acc", 2), "two processes give other bytes than one"
    assert bytes(Sums.of_files(study, files)) == one, "Python gives other bytes than the command line"

    for master, what in (("local-cluster[2,1,1024]", "executor"), ("local[2,4]", "worker")):
        engine = session(master)
        paths = engine.createDataFrame([(path,) for path in files], "path string").repartition(4)
        sums = killing(what, lambda: spark.accumulate(paths, study, path="path"))
        assert bytes(sums) == one, f"Spark gives other bytes than one process when its {what} is killed"
        print(f"{master}: the same bytes, one {what} killed on the way")
        if what == "executor":
            engine.stop()
    by_rows(engine, study, files[:3])
    scored(here, paths, study, sums, files[:3])
    damaged(engine, here, study, files, one)
    engine.stop()


def by_rows(engine: Any, study: Any, files: list) -> None:
    """The rows themselves, shuffled: known by their own hashes, so compared with one process that sums the same arrays."""
    import numpy as np
    import pyarrow.parquet as pq
    from jointwatch import spark
    from jointwatch._sums import merge_bytes, plan_of
    from pyspark.sql import functions as f

    frame = engine.read.parquet(*files).withColumn("record", f.element_at(f.split(f.input_file_name(), "/"), -1))
    frame = frame.orderBy(f.rand(seed=4))
    plan = plan_of(study)
    parts = []
    for path in files:
        table = pq.read_table(path)
        columns = [(name, np.ascontiguousarray(table[name].to_numpy())) for name in plan.columns()[0]]
        parts.append((path, plan.sum_log((Path(path).name, columns))))
    shuffled = spark.accumulate(frame, study, record="record")
    assert bytes(shuffled) == bytes(merge_bytes(parts)), "shuffled rows give other bytes than their arrays"
    print("rows in any order: the same bytes")


def scored(here: Path, paths: Any, study: Any, sums: Any, files: list) -> None:
    from jointwatch import spark

    model = sums.identify("physical", study=study)
    found = {row.record: row for row in spark.score(paths, model, study, path="path").collect()}
    model.save(here / "model.json")
    for path in files:
        name = Path(path).name
        (here / "single.toml").write_text(STUDY.format(time='time = "t"').replace("pilot.parquet", name))
        words = [os.environ["JOINTWATCH"], "compare", "single.toml", "model.json", "--json", "-"]
        told = json.loads(subprocess.run(words, cwd=here, check=True, capture_output=True, text=True).stdout)
        assert found[path].nmse_percent == told["records"][0]["axes"]["x"]["nmse_percent"], name
    print("score: the figures of compare")


def damaged(engine: Any, here: Path, study: Any, files: list, one: bytes) -> None:
    """Records that cannot be summed, and records that are there twice."""
    import pyarrow.parquet as pq
    from jointwatch import spark

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
    twice = engine.createDataFrame([(path,) for path in [*files, *files]], "path string")
    for frame, why in ((mixed, "bad.parquet"), (twice, "counted already")):
        try:
            spark.accumulate(frame, study, path="path")
        except Exception as problem:
            assert why in str(problem), problem
        else:
            raise AssertionError(f"taken, where {why!r} should have been said")
    print("a corrupt file without skip, and files given twice: refused")


def copies(here: Path, rows: int, each: int) -> list:
    """Files of so many rows in all: the same numbers in each, and another name in its footer, so that each is a record of its own."""
    import pyarrow as pa
    from pyarrow import parquet

    columns = {name: values for name, values in log(each, 0.9, 10).items() if name != "t"}
    mark = b"run 00000000"
    parquet.write_table(pa.table(columns).replace_schema_metadata({"run": mark}), here / "part.parquet")
    whole = (here / "part.parquet").read_bytes()
    files = []
    for k in range(rows // each):
        files.append(str(here / f"part{k}.parquet"))
        # The schema stands there twice: as Parquet's, and as Arrow's in base64, which nobody reads here.
        Path(files[-1]).write_bytes(whole.replace(mark, b"run %08d" % k))
    return files


def measure(here: Path, rows: int) -> None:
    from jointwatch import Study, spark

    (here / "study.toml").write_text(STUDY.format(time=""))
    write(here / "pilot.parquet", {k: v for k, v in log(20_000, 1.0, 1).items() if k != "t"})
    files = copies(here, rows, 500_000)
    study = Study.open(here / "study.toml")
    engine = session("local[2,4]")
    paths = engine.createDataFrame([(path,) for path in files], "path string").repartition(8)
    paths.count()
    found = []
    ways = {
        "two plain processes": lambda: plain(here, files, "plain.acc", 2),
        "Spark local[2]": lambda: bytes(spark.accumulate(paths, study, path="path")),
    }
    print(f"{rows:.1e} rows in {len(files)} files")
    # In turn, since other programs may come and go; Python's workers begin in the first.
    for turn in range(TURNS):
        for name, way in ways.items():
            start, cpu = time.monotonic(), children_cpu_s()
            found.append(way())
            took = time.monotonic() - start
            print(f"{turn + 1}. {name}: {took:.1f} s, {rows / took / 1e6:.2f} M rows/s, {children_cpu_s() - cpu:.1f} CPU s")
    assert len(set(found)) == 1
    engine.stop()


def children_cpu_s() -> float:
    """Processor time of all that this process has started, those that still run included."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    ticks = 0
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and ancestors(int(entry.name)):
                # Its own time, and that of its children that have ended.
                ticks += sum(map(int, (entry / "stat").read_text().rsplit(")", 1)[1].split()[11:15]))
        except OSError:
            continue
    return ended.ru_utime + ended.ru_stime + ticks / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--inside"]:
        with tempfile.TemporaryDirectory(dir=".") as made:
            here = Path(made).resolve()
            check(here) if len(sys.argv) < 3 else measure(here, int(float(sys.argv[2])))
    elif shutil.which("java") is None:
        print("SKIPPED: there is no Java, so nobody tried Spark; install default-jre-headless")
    else:
        sys.exit(in_environment(str(Path(__file__).resolve()), NEEDED, sys.argv[1:]))
