"""Debian's mosquitto with TLS, a password for each device, and a list of who may write where."""

from __future__ import annotations

import getpass
import os
import queue
import secrets
import shutil
import socket
import subprocess
import threading
import time
from pathlib import Path
from typing import Callable, Optional

Start = Callable[..., "subprocess.Popen[str]"]
"""Starts a process that is ended with the program."""

# A device writes below its own name and reads what is for all; the host reads everything.
ACL = """user host
topic read fleet/#
topic write fleet/model
topic write fleet/measure

pattern write fleet/%u/#
pattern read fleet/model
pattern read fleet/measure
"""


def installed() -> Optional[str]:
    """Nothing when mosquitto is there or could be installed, else why not."""
    os.environ["PATH"] += ":/usr/sbin"
    needed = ("mosquitto", "mosquitto_passwd", "mosquitto_pub", "mosquitto_sub", "openssl")
    if all(map(shutil.which, needed)):
        return None
    if shutil.which("apt-get") is None or os.geteuid() != 0:
        return "there is no mosquitto; install mosquitto, mosquitto-clients and openssl"
    # The package would start a broker of its own, which nobody asked for.
    words = ["apt-get", "install", "--yes", "--quiet", "mosquitto", "mosquitto-clients", "openssl"]
    kept = {**os.environ, "DEBIAN_FRONTEND": "noninteractive", "RUNLEVEL": "1"}
    for step in (["apt-get", "update", "--quiet"], words):
        done = subprocess.run(step, capture_output=True, text=True, env=kept)
        if done.returncode != 0:
            return f"mosquitto could not be installed: {' '.join(done.stderr.strip().splitlines()[-1:])}"
    return None


def certificates(folder: Path) -> None:
    """A certificate authority, and the broker's certificate, signed by it."""

    def openssl(*words: str) -> None:
        subprocess.run(["openssl", *words], cwd=folder, check=True, capture_output=True)

    new = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
    ca = ("-addext", "basicConstraints=critical,CA:TRUE", "-addext", "keyUsage=critical,keyCertSign")
    openssl("req", "-x509", *new, "-keyout", "ca.key", "-out", "ca.crt", "-days", "2", "-subj", "/CN=fleet", *ca)
    openssl("req", *new, "-keyout", "broker.key", "-out", "broker.csr", "-subj", "/CN=localhost")
    (folder / "broker.ext").write_text("subjectAltName = DNS:localhost, IP:127.0.0.1\nbasicConstraints = CA:FALSE\n")
    by = ("-CA", "ca.crt", "-CAkey", "ca.key", "-CAcreateserial", "-extfile", "broker.ext")
    openssl("x509", "-req", "-in", "broker.csr", *by, "-out", "broker.crt", "-days", "2")


class Broker:
    """The broker's files, and its clients of the host."""

    def __init__(self, folder: Path, devices: list[str]) -> None:
        self.folder = folder
        folder.mkdir()
        certificates(folder)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        (folder / "passwords").touch(mode=0o600)
        for user in ["host", *devices]:
            self.password_file(user).write_text(secrets.token_hex(16))
            words = ["mosquitto_passwd", "-b", "passwords", user, self.password_file(user).read_text()]
            subprocess.run(words, cwd=folder, check=True, capture_output=True)
        (folder / "acl").write_text(ACL)
        (folder / "acl").chmod(0o600)
        (folder / "mosquitto.conf").write_text(
            f"listener {self.port} 127.0.0.1\nuser {getpass.getuser()}\npersistence false\n"
            "allow_anonymous false\npassword_file passwords\nacl_file acl\n"
            "cafile ca.crt\ncertfile broker.crt\nkeyfile broker.key\n"
        )

    def password_file(self, user: str) -> Path:
        return self.folder / f"{user}.password"

    def start(self, run: Start) -> None:
        """Starts it, and waits until it listens."""
        with open(self.folder / "log", "w") as told:
            broker = run(["mosquitto", "-c", "mosquitto.conf"], cwd=self.folder, stderr=told)
        while True:
            assert broker.poll() is None, "mosquitto does not start"
            with socket.socket() as line:
                if line.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.05)

    def client(self, program: str, user: str, password_of: Optional[str] = None) -> list[str]:
        """The command line of a client, with the credentials of a user; `password_of` takes another's password."""
        password = self.password_file(password_of or user).read_text()
        to = ["-h", "localhost", "-p", str(self.port), "--cafile", str(self.folder / "ca.crt")]
        return [program, *to, "-V", "mqttv5", "-q", "1", "-u", user, "-P", password]

    def publish(self, user: str, topic: str, *message: str, password_of: Optional[str] = None) -> str:
        """Publishes; gives what the client complains of."""
        words = [*self.client("mosquitto_pub", user, password_of), "-t", topic, *message]
        done = subprocess.run(words, capture_output=True, text=True)
        return (done.stdout + done.stderr).strip()


class Inbox:
    """What the host hears, in the order in which it came."""

    def __init__(self, broker: Broker, run: Start) -> None:
        words = [*broker.client("mosquitto_sub", "host"), "-t", "fleet/+/#", "-F", "%t %x"]
        client = run(words, stdout=subprocess.PIPE)
        self._unread: list[tuple[str, bytes]] = []
        self._came: "queue.Queue[tuple[str, bytes]]" = queue.Queue()
        threading.Thread(target=self._read, args=(client,), daemon=True).start()

    def _read(self, client: subprocess.Popen[str]) -> None:
        assert client.stdout is not None
        for line in client.stdout:
            topic, _, content = line.strip().partition(" ")
            self._came.put((topic, bytes.fromhex(content)))

    def until(self, topic: str, content: Optional[bytes] = None, within_s: float = 90.0) -> bytes:
        """Takes the first message of a topic, with such a content where one is given; waits until it comes."""
        end = time.monotonic() + within_s
        seen = 0
        while True:
            for at in range(seen, len(self._unread)):
                if self._unread[at][0] == topic and content in (None, self._unread[at][1]):
                    return self._unread.pop(at)[1]
            seen = len(self._unread)
            try:
                self._unread.append(self._came.get(timeout=max(end - time.monotonic(), 0.0)))
            except queue.Empty:
                raise AssertionError(f"{topic} never came; unread are {self._unread}") from None

    def unread(self) -> list[str]:
        """The topics of what nobody has taken yet."""
        return [topic for topic, _ in self._unread]
