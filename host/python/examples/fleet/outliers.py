"""Which devices' sums do not fit those of the others."""

from __future__ import annotations

from statistics import median

import jointwatch as jw

LIMIT = 6.0
"""Robust standard deviations. Honest devices of a fleet of three lie within 0.7 by construction, so this leaves room for a joint that
differs a little; sums with forces scaled by 1.5 lie hundreds away."""


def strengths(sums: jw.Sums) -> dict[str, tuple[float, float]]:
    """The strengths of the effects that some sums alone give, each with the half-width of its 95 % interval."""
    found = {}
    for effect in sums.identify("physical").to_dict()["effects"]:
        for parameter in effect["parameters"]:
            low, high = parameter["interval"]
            found[f"{effect['effect']}@{effect['axis']} {parameter['name']}"] = (parameter["value"], (high - low) / 2)
    return found


def outliers(devices: dict[str, jw.Sums]) -> dict[str, str]:
    """The devices whose strengths lie too far from the fleet's median, each with the strength that lies furthest.

    The spread is the median absolute deviation, or the median half-width of the intervals where that is larger: neither moves when
    fewer than half of the devices lie. Strengths, because a falsified force leaves the residual as small as an honest one. A joint that
    has changed looks like a lie, and is left out as well; a lie within the spread of the fleet is not seen.
    """
    of_device = {name: strengths(sums) for name, sums in devices.items()}
    found: dict[str, tuple[float, str]] = {}
    for strength in next(iter(of_device.values())):
        values = {name: of_device[name][strength][0] for name in of_device}
        middle = median(values.values())
        deviation = 1.4826 * median(abs(value - middle) for value in values.values())
        spread = max(deviation, median(of_device[name][strength][1] for name in of_device))
        for name, value in values.items():
            far = abs(value - middle) / spread
            if far > max(LIMIT, found.get(name, (0.0, ""))[0]):
                found[name] = (far, f"{strength} is {value:.4g} where the fleet's median is {middle:.4g}")
    return {name: why for name, (_, why) in found.items()}
