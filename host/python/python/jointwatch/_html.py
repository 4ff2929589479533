"""Results as HTML for notebooks: tables, and the library's own pictures."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

SHOWN = 4
"""Pictures that are shown at most; `pictures()` gives all."""


def names_of_effects(model: Mapping[str, Any]) -> list[str]:
    """The effects of a model, as `add` takes them."""
    return [effect_name(effect) for effect in model.get("effects", [])]


def effect_name(effect: Mapping[str, Any]) -> str:
    """`coulomb@x`, `coulomb*voltage@x`, `clearance_coupling`."""
    return f"{effect['effect']}@{effect['axis']}" if effect.get("axis") else str(effect["effect"])


def base_of(model: Mapping[str, Any]) -> str:
    """What stands beside a model's effects."""
    base = model["base"]
    return "effects alone" if "none" in base else str(next(iter(base)))


def verdict_in_words(said: Mapping[str, Any]) -> str:
    """A diagnosis in a line."""
    if said["verdict"] == "none":
        return "nothing is missing"
    if said["verdict"] == "data":
        return "the data are at fault: " + "; ".join(said["data_problems"])
    found = ", ".join(f"{f['effect']}@{f['axis']}" for f in said["found"])
    if said["verdict"] == "unknown":
        return "something is missing that the library does not know" + (f", beside {found}" if found else "")
    return f"missing: {found}"


def of_study(said: Mapping[str, Any]) -> str:
    """Axes, records and notes."""
    axes = ([a["name"], a["kind"], number(a["inertia"]), a["inertia_unit"]] for a in said["axes"])
    records = ([r["file"], r["role"], str(r["rows"]), f"{r['seconds']:.1f}"] for r in said["records"])
    return (
        title(f"{said['name']}, {said['sample_rate_hz']:g} Hz")
        + table(["axis", "kind", "inertia", "unit"], axes)
        + table(["record", "role", "rows", "s"], records)
        + sentences([*said["checks"], *said["notes"]])
    )


def of_model(said: Mapping[str, Any]) -> str:
    """Effects with values, errors and warnings."""
    rows = []
    for effect in said.get("effects", []):
        for p in effect["parameters"]:
            between = p.get("interval")
            interval = "" if not between else " to ".join(number(end) for end in between)
            rows.append([effect_name(effect), p["name"], number(p["value"]), p["unit"], interval])
    errors = (
        [e["axis"], records, percent(e["relative_error"])]
        for records in ("verification", "validation")
        for e in said[records]
    )
    return (
        title(f"Model of {said['study']}: {base_of(said)}")
        + (table(["effect", "parameter", "value", "unit", "95 % interval"], rows) if rows else "")
        + table(["axis", "records", "relative error"], errors)
        + sentences(said["warnings"])
    )


def of_comparison(said: Mapping[str, Any], pictures: Mapping[str, str]) -> str:
    """Errors record by record, where they sit, and pictures."""
    rows = (
        [r["file"], r["role"], axis, percent(f["relative_error"]), f"{f['nmse_percent']:.3g} %"]
        for r in said["records"]
        for axis, f in r["axes"].items()
    )
    return (
        table(["record", "role", "axis", "relative error", "NMSE"], rows)
        + sentences([*said["data_problems"], *(place["region"] for place in said["where"])])
        + drawn(pictures)
    )


def of_diagnosis(said: Mapping[str, Any], pictures: Mapping[str, str]) -> str:
    """The verdict, candidates, errors and pictures."""
    verdict = verdict_in_words(said)
    candidates = (
        [f"{r['effect']}@{r['axis']}", f"{r['probability']:.2f}", percent(r["error_before"]), percent(r["error_after"])]
        for r in said["ranked"]
    )
    after, floor = said["relative_error_after"], said["noise_floor"]
    errors = (
        [axis, percent(before), percent(after[axis]), percent(floor[axis])]
        for axis, before in said["relative_error_before"].items()
    )
    return (
        title(verdict[0].upper() + verdict[1:])
        + table(["axis", "error before", "after", "noise floor"], errors)
        + table(["candidate", "probability", "error without", "with"], candidates)
        + sentences(said["notes"])
        + drawn(pictures)
    )


def of_added(said: Mapping[str, Any], effects: Sequence[str], pictures: Mapping[str, str]) -> str:
    """Errors before and after, and pictures."""
    errors = said["errors"]
    rows = (
        [b["axis"], percent(b["relative_error"]), percent(a["relative_error"]), percent(said["noise_floor"][b["axis"]])]
        for b, a in zip(errors["before"], errors["after"])
    )
    return (
        title(f"Added {', '.join(effects)}{'' if said['helps'] else ': it does not help'}")
        + table(["axis", "error before", "after", "noise floor"], rows)
        + drawn(pictures)
    )


def of_response(said: Mapping[str, Any]) -> str:
    """Figures record by record."""
    every = [figures for r in said["records"] for figures in r["axes"].values()]
    keys = [key for key in (every[0] if every else {}) if any(is_number(figures[key]) for figures in every)]
    rows = (
        [r["file"], r["role"], axis, percent(r["simulated"]), *(number(figures[key]) for key in keys)]
        for r in said["records"]
        for axis, figures in r["axes"].items()
    )
    heading = ["record", "role", "axis", "simulated", *(key.replace("_", " ") for key in keys)]
    return table(heading, rows) + sentences(said["notes"])


def of_export(said: Mapping[str, Any]) -> str:
    """What fixed point costs."""
    rows = (
        [a["axis"], number(a["largest_error"]), number(a["error_bound"]), number(a["bound_relative"])] for a in said["axes"]
    )
    return title(f"{said['bytes']} bytes in {said['blob']}") + table(
        ["axis", "largest error seen", "proven bound", "bound / RMS force"], rows
    )


def is_number(value: Any) -> bool:
    """Whether a figure is one number."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def number(value: Any) -> str:
    """Six digits; nothing where there is no number."""
    return f"{value:.6g}" if is_number(value) else ""


def percent(part: float) -> str:
    """A part in percent."""
    return f"{100 * part:.3g} %"


def title(text: str) -> str:
    """A heading."""
    return f"<h4>{escape(text)}</h4>"


def table(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of texts."""

    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(str(cell))}</{tag}>" for cell in cells) + "</tr>"

    return "<table>" + row(heading, "th") + "".join(row(cells, "td") for cells in rows) + "</table>"


def sentences(all_of_them: Iterable[str]) -> str:
    """Sentences, a line each."""
    return "".join(f"<p>{escape(text)}.</p>" for text in all_of_them)


def drawn(pictures: Mapping[str, str]) -> str:
    """The first pictures of those that say most: the staircase, where the model fails, forces over time."""
    order = ("staircase", "where", "")
    best = sorted(pictures, key=lambda name: next(i for i, begin in enumerate(order) if name.startswith(begin)))

    def image(name: str) -> str:
        data = base64.b64encode(pictures[name].encode()).decode()
        return f'<img alt="{escape(name)}" style="max-width:100%;width:48em" src="data:image/svg+xml;base64,{data}">'

    return "".join(image(name) for name in best[:SHOWN])
