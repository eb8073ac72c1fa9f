"""A quick look at corrected ticks."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._arrays import Array, CorrectedBatch, angular_rate, specific_force
from ._layout import TICK_FLAGS

_MARKED = ("GAP", "RESTART", "ANGLE_INVALID", "UNCALIBRATED", "PARITY_EXCEEDED", "SWITCH_UNRESOLVED")


def plot(ticks: Array | CorrectedBatch, *, title: str | None = None) -> Any:
    """Draws rates (°/s) and specific forces (m/s²) of case x, y, z over time, with flagged outputs marked.

    Returns the matplotlib figure: `.savefig(...)` or `matplotlib.pyplot.show()`. Needs `isotherm[plot]`.
    """
    try:
        from matplotlib import pyplot
    except ImportError:
        raise ImportError("plotting needs the package matplotlib: pip install isotherm[plot]") from None
    if isinstance(ticks, CorrectedBatch):
        title = ticks.unit if title is None else title
        ticks = ticks.ticks
    if len(ticks) == 0:
        raise ValueError("there are no ticks to plot")
    time_s = (ticks["end_time_ns"] - ticks["end_time_ns"][0]) * 1e-9
    figure, (rates, forces) = pyplot.subplots(2, 1, sharex=True, constrained_layout=True)
    panels = [(rates, np.degrees(angular_rate(ticks)), "rate, °/s"), (forces, specific_force(ticks), "specific force, m/s²")]
    for axes, values, label in panels:
        for axis, name in enumerate("xyz"):
            axes.plot(time_s, values[:, axis], linewidth=0.8, label=name)
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    for name in _MARKED:
        flagged = (ticks["flags"] & TICK_FLAGS[name]) != 0
        if flagged.any():
            lowest = np.full(int(flagged.sum()), rates.get_ylim()[0])
            words = name.lower().replace("_", " ")
            rates.plot(time_s[flagged], lowest, "|", label=f"{words}: {len(lowest)}")
    rates.legend(loc="upper right", fontsize="small")
    forces.set_xlabel(f"time since {ticks['end_time_ns'][0]} ns, s")
    if title:
        figure.suptitle(title)
    return figure
