"""A fleet on this machine: emulated devices, a bridge beside each, a broker, a host; one device lies, one drops out.

    python run.py [PROGRAM]

PROGRAM is `jointwatch`, found on the search path when left out; the Python package has to be installed. Devices are the firmware under
QEMU. Everything listens on 127.0.0.1 only, lies in a temporary folder, and is ended with this program, after five minutes at most.
"""

from __future__ import annotations

import ctypes
import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Optional

import jointwatch as jw
import numpy as np
from broker import Broker, Inbox, installed
from outliers import outliers

HERE = Path(__file__).resolve().parent
RATE_HZ = 500.0
ROWS = 3000
"""Samples of a part: six seconds of the device's time."""
DEVICES = ["a", "b", "c"]
"""b drops out, c lies."""
LONGEST_S = 300
FIRST = '["stiffness@x", "viscous@x"]'
TERMS = '["stiffness@x", "viscous@x", "cubic_hardening@x"]'
RECORD = '[[record]]\nfile = "{file}"\nrole = "{role}"\n'
# Stands in for the tool at the bridge that lies: it scales the force before the sums are made.
LIAR = """#!{python}
import csv, os, sys
words = sys.argv[1:]
if "accumulate" in words:
    for log in (word for word in words if word.endswith(".csv")):
        rows = list(csv.reader(open(log)))
        force = rows[0].index("x_F_N")
        for row in rows[1:]:
            row[force] = repr(1.5 * float(row[force]))
        csv.writer(open(log, "w")).writerows(rows)
os.execv({program!r}, [{program!r}, *words])
"""


class Fleet:
    """The processes that run, and the files that they share."""

    def __init__(self, folder: Path, program: str, bridge: Path) -> None:
        self.folder, self.program, self.bridge = folder, program, bridge
        self.running: list[subprocess.Popen[str]] = []
        self.broker = Broker(folder / "broker", DEVICES)
        self.of_device: dict[str, list[subprocess.Popen[str]]] = {}

    def tool(self, *words: Any) -> str:
        """Runs the tool in the folder; gives what it prints."""
        told = [self.program, *map(str, words)]
        done = subprocess.run(told, cwd=self.folder, capture_output=True, text=True)
        assert done.returncode == 0, f"{' '.join(told)}: {done.stderr}"
        return done.stdout

    def run(self, words: list[str], **more: Any) -> subprocess.Popen[str]:
        """Starts a process that is ended with this program, and so are those that it starts."""
        started = subprocess.Popen(words, text=True, stdin=subprocess.DEVNULL, start_new_session=True, **more)
        self.running.append(started)
        return started

    def switch_on(self, name: str) -> None:
        """Starts a device, and the bridge beside it."""
        words = [self.program, "emulate", "model.bin", "rig", "--record", f"{name}.csv", "--rig", "rig.bin", "--serve", "0"]
        device = self.run([*words, "--json", "-"], cwd=self.folder, stdout=subprocess.PIPE)
        assert device.stdout is not None
        found = (re.search(r"127\.0\.0\.1:\d+", line) for line in device.stdout)
        address = next(filter(None, found))[0]
        program = self.folder / "liar" if name == "c" else self.program
        given = {
            "name": name,
            "device": address,
            "broker": f"localhost:{self.broker.port}",
            "ca": self.broker.folder / "ca.crt",
            "password": self.broker.password_file(name),
            "study": "fleet",
            "rig": "rig.bin",
            "folder": f"of-{name}-{len(self.running)}",
            "program": program,
        }
        words = [str(self.bridge), *(f"{key}={value}" for key, value in given.items())]
        self.of_device[name] = [device, self.run(words, cwd=self.folder)]

    def switch_off(self, name: str) -> None:
        """Ends a device and its bridge as a loss of power does."""
        for process in self.of_device.pop(name):
            end(process)

    def stop(self) -> None:
        """Ends everything, and sees that it is gone."""
        for process in reversed(self.running):
            end(process)
        try:
            while True:
                os.waitpid(-1, 0)
        except ChildProcessError:
            pass


def end(process: subprocess.Popen[str]) -> None:
    """Ends a process and those that it started."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait()


def log(path: Path, size: float, seconds: float, seed: int) -> None:
    """What a rig logs of a hardening spring with damping."""
    random = np.random.default_rng(seed)
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    x, v = np.zeros(len(t)), np.zeros(len(t))
    for k in range(10):
        w, phase = 2 * np.pi * (1 + 2 * k + random.uniform()), random.uniform(0, 2 * np.pi)
        a = size * random.uniform(1e-4, 4e-4)
        x += a * np.sin(w * t + phase)
        v += a * w * np.cos(w * t + phase)
    force = 2e4 * x + 30 * v + 4e9 * x**3 + random.normal(0, 0.05, len(t))
    np.savetxt(path, np.column_stack([t, x, force]), delimiter=",", header="t_s,x_m,force_N", comments="", fmt="%.9e")


def first_model(fleet: Fleet) -> None:
    """A model of a pilot record that lacks an effect, and from its replay the study that the whole fleet sums by."""
    rig = fleet.folder / "rig"
    rig.mkdir()
    log(rig / "pilot.csv", 0.8, 12.0, 1)
    for seed, name in enumerate(["valid", *DEVICES], start=2):
        log(rig / f"{name}.csv", 1.0, 20.0, seed)
    records = [RECORD.format(file="pilot.csv", role="train")]
    records += [RECORD.format(file=f"{name}.csv", role="validate") for name in ["valid", *DEVICES]]
    axis = '[[axis]]\nname = "x"\nkind = "translation"\ndisplacement = "x_m"\nforce = "force_N"\ninertia = 0.0\n'
    text = f'name = "press"\ntime = "t_s"\n{axis}{"".join(records)}[base]\nterms = {FIRST}\n'
    (rig / "study.toml").write_text(text)
    fleet.tool("identify", "rig", "--model", "physical", "-o", "model.json")
    fleet.tool("export", "model.json", "-o", "model.bin")
    fleet.tool("export", "model.json", "--rig", "defaults", "--study", "rig", "-o", "rig.bin")
    replay = ["replay", "model.bin", "rig", "--record", "pilot.csv", "--rig", "rig.bin"]
    fleet.tool(*replay, "--frames", "pilot.frames")
    fleet.tool("study-from", "pilot.frames", "--rig", "rig.bin", "-o", "fleet")
    study = fleet.folder / "fleet/study.toml"
    kept = [line for line in study.read_text().splitlines() if not line.startswith("terms =")]
    study.write_text("\n".join([*kept, f"terms = {TERMS}", ""]))


def only_its_own(fleet: Fleet, inbox: Inbox) -> None:
    """A device cannot write as another one, neither with its own password nor with a guessed one."""
    broker = fleet.broker
    for complaint in (
        broker.publish("a", "fleet/a/part/forged", "-m", "x", password_of="c"),
        broker.publish("c", "fleet/a/part/forged", "-m", "x"),
        broker.publish("c", "fleet/model", "-m", "x"),
    ):
        assert "Not authorized" in complaint, complaint
    # Had the forged one passed, it would have come before this one.
    broker.publish("c", "fleet/c/part/own", "-m", "x")
    inbox.until("fleet/c/part/own")
    assert "fleet/a/part/forged" not in inbox.unread()
    print("c's password does not open a's account, and c's own account does not write to a's topics or to the model's.")


def two_rounds(fleet: Fleet, inbox: Inbox) -> dict[str, list[bytes]]:
    """Two parts of each device; b is lost while it measures the second."""
    parts: dict[str, list[bytes]] = {name: [] for name in DEVICES}
    fleet.broker.publish("host", "fleet/measure", "-m", f"1 {ROWS}")
    for name in DEVICES:
        parts[name].append(inbox.until(f"fleet/{name}/part/1"))
    fleet.broker.publish("host", "fleet/measure", "-m", f"2 {ROWS}")
    inbox.until("fleet/b/state", b"measures 2")
    fleet.switch_off("b")
    inbox.until("fleet/b/state", b"lost")
    print("b lost its supply while it measured; its last will says so.")
    for name in ("a", "c"):
        parts[name].append(inbox.until(f"fleet/{name}/part/2"))
    return parts


def merged(fleet: Fleet, parts: list[bytes]) -> jw.Sums:
    """The sums of parts, which are the same bytes in any order."""
    files = []
    for number, part in enumerate(parts):
        files.append(f"part{number}.acc")
        (fleet.folder / files[-1]).write_bytes(part)
    orders = set()
    for order in itertools.permutations(parts):
        whole = jw.Sums(order[0])
        for part in order[1:]:
            whole = whole + jw.Sums(part)
        orders.add(bytes(whole))
    fleet.tool("merge", *files, "-o", "all.acc")
    orders.add((fleet.folder / "all.acc").read_bytes())
    assert len(orders) == 1, "the order of the parts changes the sums"
    return jw.Sums(orders.pop())


def new_model(fleet: Fleet, parts: dict[str, list[bytes]]) -> bytes:
    """Leaves the liar out, and makes a signed model of the sums of the others."""
    merged(fleet, [part for some in parts.values() for part in some])
    left_out = outliers({name: merged(fleet, some) for name, some in parts.items()})
    for name, why in left_out.items():
        print(f"{name} is left out: {why}.")
    assert list(left_out) == ["c"], left_out
    sums = merged(fleet, [part for name, some in parts.items() if name not in left_out for part in some])
    sums.identify("physical").save(fleet.folder / "new.json")
    errors = []
    for model in ("model.json", "new.json"):
        told = json.loads(fleet.tool("compare", "rig", model, "--json", "-"))
        valid = next(record for record in told["records"] if record["file"] == "valid.csv")
        errors.append(valid["axes"]["x"]["nmse_percent"])
    print(f"A model of {len(sums.records)} parts, {sums.rows} rows: NMSE on another record {errors[1]:.2g} %, {errors[0]:.2g} % before.")
    assert errors[1] < errors[0], errors
    fleet.tool("export", "new.json", "-o", "new.bin")
    fleet.tool("export", "new.json", "--rig", "defaults", "--study", "rig", "-o", "new-rig.bin")
    # The firmware that is emulated trusts the development key; one for real devices is built with the fleet's own.
    fleet.tool("sign", "new.bin", "--rig", "new-rig.bin", "--development-key", "-o", "new.signed")
    fleet.tool("keygen", "-o", "stranger")
    fleet.tool("sign", "new.bin", "--rig", "new-rig.bin", "--key", "stranger", "-o", "strange.signed")
    return (fleet.folder / "new.bin").read_bytes()


def rolled_out(fleet: Fleet, inbox: Inbox, blob: bytes) -> None:
    """A stranger's model is refused by every device; the fleet's own comes to all, to b when it is back."""
    checksum = int.from_bytes(blob[-4:], "little")

    def takes(name: str) -> None:
        hello = json.loads(inbox.until(f"fleet/{name}/runs"))
        assert hello["model"]["crc"] == checksum, hello

    fleet.broker.publish("host", "fleet/model", "-f", str(fleet.folder / "strange.signed"))
    for name in ("a", "c"):
        why = inbox.until(f"fleet/{name}/trouble").decode()
        assert "signature is not by the key" in why, why
    print("A model signed by another key: a and c refuse it.")
    fleet.broker.publish("host", "fleet/model", "-r", "-f", str(fleet.folder / "new.signed"))
    for name in ("a", "c"):
        takes(name)
    fleet.switch_on("b")
    inbox.until("fleet/b/state", b"here")
    takes("b")
    print("The fleet's model: a and c run it, and b since it came back.")


def traffic(fleet: Fleet, parts: dict[str, list[bytes]]) -> None:
    """What an hour of a device costs as samples and as sums."""
    frames = next(fleet.folder.glob("of-a-*/a-1.frames")).stat().st_size
    rows = jw.Sums(parts["a"][0]).rows
    hour = 3600 * RATE_HZ * frames / rows
    print(f"Per device and hour: {hour / 1e6:.0f} MB of frames with samples, or one part of {len(parts['a'][0]) / 1e3:.1f} kB.")


def story(fleet: Fleet) -> None:
    first_model(fleet)
    (fleet.folder / "liar").write_text(LIAR.format(python=sys.executable, program=fleet.program))
    (fleet.folder / "liar").chmod(0o755)
    fleet.broker.start(fleet.run)
    inbox = Inbox(fleet.broker, fleet.run)
    for name in DEVICES:
        fleet.switch_on(name)
    for name in DEVICES:
        inbox.until(f"fleet/{name}/state", b"here")
    print(f"Devices {', '.join(DEVICES)} are connected with TLS, each with its own password.")
    only_its_own(fleet, inbox)
    parts = two_rounds(fleet, inbox)
    rolled_out(fleet, inbox, new_model(fleet, parts))
    traffic(fleet, parts)


def bridge() -> Path:
    """The bridge, built if need be."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", HERE.parents[3] / "target")) / "fleet"
    words = ["cargo", "build", "--release", "--quiet", "--locked", "--target-dir", str(target)]
    subprocess.run(words, cwd=HERE, check=True)
    return target / "release/fleet-bridge"


def main() -> int:
    program = shutil.which(sys.argv[1] if len(sys.argv) > 1 else "jointwatch")
    assert program is not None, "there is no jointwatch; name the program"
    missing: Optional[str] = installed()
    if missing is None and sys.platform != "linux":
        missing = "this needs Linux"
    if missing is None and shutil.which("qemu-system-arm") is None:
        missing = "there is no qemu-system-arm"
    if missing is not None:
        print(f"SKIPPED: {missing}, so nobody tried the fleet")
        return 0
    built = bridge()

    def over(*_: Any) -> None:
        raise TimeoutError(f"the fleet took more than {LONGEST_S} s, or was told to end")

    signal.signal(signal.SIGALRM, over)
    signal.signal(signal.SIGTERM, over)
    signal.alarm(LONGEST_S)
    # What a killed process had started becomes a child of this one (PR_SET_CHILD_SUBREAPER), so that nothing is left unseen.
    ctypes.CDLL(None).prctl(36, 1)
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as made:
        fleet = Fleet(Path(made), str(Path(program).resolve()), built)
        try:
            story(fleet)
        finally:
            fleet.stop()
    print(f"Done in {time.monotonic() - begun:.0f} s; nothing is left running.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
