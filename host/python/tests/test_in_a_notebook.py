"""What a notebook and a long calculation need: HTML, pictures, progress, Ctrl-C, threads that go on."""

import signal
import threading
import time
import xml.etree.ElementTree
from html.parser import HTMLParser

import jointwatch as jw
import pytest

from conftest import Rig, joint


class Balanced(HTMLParser):
    """Whether every element ends."""

    def __init__(self) -> None:
        super().__init__()
        self.open, self.seen = [], set()

    def handle_starttag(self, tag, attrs) -> None:
        self.seen.add(tag)
        if tag != "img":
            self.open.append(tag)

    def handle_endtag(self, tag) -> None:
        assert self.open.pop() == tag


def html(shown) -> tuple:
    text = shown._repr_html_()
    parser = Balanced()
    parser.feed(text)
    assert not parser.open
    return text, parser.seen


def test_everything_shows_itself(rig: Rig, tmp_path) -> None:
    study, base = jw.Study.open(rig.study), jw.Model.open(rig.folder / "base.json")
    comparison, diagnosis = base.compare(study), base.diagnose(study)
    added = base.add("coulomb@x", study)
    response, exported = added.model.respond(study), added.model.export(tmp_path / "model.bin")
    assert "coulomb@x" in html(diagnosis)[0] and "Missing" in html(diagnosis)[0]
    assert "coulomb@x" in html(added.model)[0]
    for shown in (study, base, response, exported):
        assert "table" in html(shown)[1]
    rows = html(response)[0].split("<tr>")[1:]
    assert len({row.count("<t") for row in rows}) == 1, "a row of other cells than the heading"
    for drawn in (comparison, diagnosis, added):
        assert {"table", "img"} <= html(drawn)[1]
        for name, svg in drawn.pictures().items():
            assert name.endswith(".svg")
            xml.etree.ElementTree.fromstring(svg)
    assert "staircase.svg" in diagnosis.pictures()
    for reported in (comparison, diagnosis, added, response):
        reported.report(tmp_path / "page.html")
        assert "</html>" in (tmp_path / "page.html").read_text()
    for shown in (study, base, comparison, diagnosis, added, response, exported):
        assert repr(shown).startswith("<") and "\n" not in repr(shown)
    simulated, measured = response.states()
    assert len(simulated) == len(measured) == 2 and len(simulated[0]) == len(measured[0])
    seen = base.predict_study(study)[0]["axes"]["x"]
    assert len(seen["measured"]) == len(seen["predicted"]) == len(seen["time_s"])


def test_html_shows_names_as_text(rig: Rig) -> None:
    data = joint(2000)
    study = jw.Study.from_arrays(t=data["t"], force=data["force"], displacement=data["displacement"], name="<b>bold</b>")
    assert "<b>bold" not in html(study)[0]


def long_work():
    data = joint(16000)
    study = jw.Study.from_arrays(
        t=data["t"], force=data["force"], displacement=data["displacement"], inertia=1.7, validate=0.3
    )
    return study, study.identify("physical", terms=["stiffness@x", "viscous@x"])


def test_progress_is_told_and_other_threads_go_on() -> None:
    study, model = long_work()
    told, counted, done = [], [0], threading.Event()

    def count() -> None:
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    begun = time.monotonic()
    diagnosis = model.diagnose(study, progress=lambda what, share, steps: told.append((what, share, steps)))
    took = time.monotonic() - begun
    done.set()
    thread.join()
    assert diagnosis.verdict == "effect"
    assert told and any("axis x" in what for what, _, _ in told)
    steps = [step for _, _, step in told]
    assert steps == sorted(steps) and steps[-1] > 0
    # With Python's lock held it would have counted to next to nothing.
    assert counted[0] > 20 * took


def test_progress_as_a_bar(capsys) -> None:
    pytest.importorskip("tqdm")
    study, model = long_work()
    model.diagnose(study, progress=True)
    assert "axis x" in capsys.readouterr().err


def test_ctrl_c_ends_long_work() -> None:
    # Python leaves Ctrl-C alone where whoever started it has it ignored, as a shell does with what runs behind it.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    study, model = long_work()
    for work in (
        lambda progress: model.diagnose(study, progress=progress),
        lambda progress: study.identify("network", restarts=1000, progress=progress),
    ):
        pressed = []

        def press(what, share, steps) -> None:
            # From another thread, once the work has begun: no clock says how long it takes on this machine.
            if not pressed:
                pressed.append(time.monotonic())
                threading.Timer(0.0, lambda: signal.raise_signal(signal.SIGINT)).start()

        with pytest.raises(KeyboardInterrupt):
            work(press)
        assert pressed and time.monotonic() - pressed[0] < 20.0
    signal.signal(signal.SIGINT, before)
    # Nothing is left behind: the same work gives the same afterwards.
    assert model.diagnose(study).verdict == "effect"


def test_what_a_callback_raises_ends_the_work() -> None:
    study, model = long_work()

    def enough(what, share, steps) -> None:
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        model.diagnose(study, progress=enough)
