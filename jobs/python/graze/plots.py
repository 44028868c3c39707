"""Pictures of a campaign by matplotlib (on Debian: apt-get install python3-matplotlib).

>>> import graze, graze.plots
>>> campaign = graze.open("quadruped_curb.graze")
>>> graze.plots.rates(campaign)
>>> graze.plots.scatter(campaign, "step/3cm", "contact.friction", "upright")

Each draws into `ax`, or into a figure of its own, and returns the axes. `graze report` and `graze plot` draw more, without Python.
"""
from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Iterable, Optional, Sequence, Tuple, Union

import numpy as np

from .campaign import OUTCOMES, Campaign, CampaignError
from .errors import nearest

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = dict(zip(OUTCOMES, ("#0072b2", "#d55e00", "#e69f00", "#999999")))  # Okabe and Ito's: told apart by everybody


def clopper_pearson(successes: int, n: int, confidence: float = 0.95) -> Tuple[float, float]:
    """The exact interval of a rate; (0, 1) of none. The same as that of `graze score`."""
    if not 0 <= successes <= n:
        raise ValueError(f"{successes} successes of {n}: must lie from 0 to {n}")
    k = np.arange(n + 1)
    chosen = np.array([math.lgamma(n + 1) - math.lgamma(i + 1) - math.lgamma(n - i + 1) for i in range(n + 1)])

    def share(p: float, which: np.ndarray) -> float:
        """How likely a binomial number is among `which`, in ascending order."""
        return float(np.exp(chosen[which] + which * math.log(p) + (n - which) * math.log1p(-p)).sum())

    tail = (1 - confidence) / 2
    low = 0.0 if successes == 0 else _bisect(lambda p: share(p, k[successes:]) < tail)
    high = 1.0 if successes == n else _bisect(lambda p: share(p, k[:successes + 1]) > tail)
    return low, high


def _bisect(below: Any) -> float:
    """Where `below` turns from true to false between 0 and 1."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if below(middle) else (low, middle)
    return (low + high) / 2


def rates(campaign: Campaign, policies: Union[None, str, Iterable[str]] = None, *, ax: Optional["Axes"] = None) -> "Axes":
    """The success rate of each policy with its 95 % interval (Clopper and Pearson), the first on top."""
    names = _policies(campaign, policies)
    counts = campaign.counts()
    ax = _axes(ax, (7, 0.9 + 0.35 * len(names)))
    for place, name in enumerate(names):
        successes, n = int(counts.loc[name, "success"]), int(counts.loc[name, "n"])
        low, high = clopper_pearson(successes, n)
        ax.plot([low, high], [place, place], color="0.4", lw=1.5, solid_capstyle="butt")
        if n > 0:
            ax.plot(successes / n, place, "o", color=COLORS["success"])
    ax.set_yticks(range(len(names)), [f"{name}  ({int(counts.loc[name, 'n'])})" for name in names])
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_xlim(-0.02, 1.02)
    ax.set_xlabel("success rate, with 95 % interval")
    ax.grid(axis="x", alpha=0.3)
    return ax


def survival(campaign: Campaign, policies: Union[None, str, Iterable[str]] = None, *, ax: Optional["Axes"] = None) -> "Axes":
    """The share of traces that have violated nothing yet, over time. Traces that end without a violation count until then."""
    ax = _axes(ax, (7, 4))
    for name in _policies(campaign, policies):
        traces = campaign.traces(name)
        traces = traces[traces["outcome"] != "invalid"]
        first = campaign.first_violations(name).loc[traces.index, campaign.requirements].min(axis=1)
        ended = traces["end_time"].to_numpy()
        time = np.fmin(first.to_numpy(), ended)
        failed = (~np.isnan(first.to_numpy())) & (first.to_numpy() <= ended)
        ax.step(*_kaplan_meier(time, failed), where="post", label=name)
    ax.set_ylim(-0.02, 1.02)
    ax.set_xlim(left=0)
    ax.set_xlabel("time, s")
    ax.set_ylabel("share without a violation")
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)
    return ax


def _kaplan_meier(time: np.ndarray, failed: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Times and shares of the product-limit estimate (Kaplan and Meier 1958)."""
    at, share = [0.0], [1.0]
    for moment in np.unique(time[failed]):
        left = np.count_nonzero(time >= moment)
        at.append(float(moment))
        share.append(share[-1] * (1 - np.count_nonzero(failed & (time == moment)) / left))
    if len(time) > 0:
        at.append(float(time.max()))
        share.append(share[-1])
    return np.array(at), np.array(share)


def scatter(campaign: Campaign, policy: str, parameter: str, margin: Optional[str] = None, *,
            ax: Optional["Axes"] = None) -> "Axes":
    """Each trace at the value of a parameter and its margin of a requirement or measure (default: the first requirement),
    in the colour of its outcome. Below 0: violated."""
    values, margins, traces = campaign.values(), campaign.margins(policy), campaign.traces(policy)
    margin = margin if margin is not None else (campaign.requirements or list(margins.columns) or [""])[0]
    for name, known, what in ((parameter, values.columns, "parameter"), (margin, margins.columns, "requirement or measure")):
        if name not in known:
            raise CampaignError(f"{campaign.path}: has no {what} '{name}'{nearest(name, known)}")
    ax = _axes(ax, (6, 4))
    for outcome in OUTCOMES:
        which = traces.index[traces["outcome"] == outcome]
        if len(which) > 0:
            ax.plot(values.loc[which, parameter], margins.loc[which, margin], ".", color=COLORS[outcome],
                    label=f"{outcome.replace('_', ' ')} ({len(which)})")
    ax.axhline(0, color="k", lw=0.8, ls=":")
    unit = campaign.parameters.loc[parameter, "unit"]
    ax.set_xlabel(f"{parameter}, {unit}" if unit not in ("", "1") else parameter)
    unit = campaign.margin_units.get(margin, "")
    ax.set_ylabel(f"margin of {margin}, {unit}" if unit not in ("", "1") else f"margin of {margin}")
    ax.set_title(policy)
    ax.legend(frameon=False)
    return ax


def telemetry(campaign: Campaign, policy: str, particle: int, names: Union[str, Sequence[str]], *, kind: str = "q",
              ax: Optional["Axes"] = None) -> "Axes":
    """Positions (kind "q"), velocities ("v") or torques ("tau") of one trace over time, by their names ("base.z")."""
    frames = campaign.telemetry(policy, particle)
    if frames.empty:
        raise CampaignError(f"{campaign.path}: keeps no frames of particle {particle} under {policy}; run it with "
                            f"telemetry='all', or 'graze replay' the particle")
    if kind not in ("q", "v", "tau"):
        raise CampaignError(f"kind={kind!r}: must be 'q', 'v' or 'tau'")
    ax = _axes(ax, (7, 4))
    known = list(frames[kind].columns)
    for name in [names] if isinstance(names, str) else names:
        if name not in known:
            raise CampaignError(f"{campaign.path}: has no {kind} of the name '{name}'{nearest(name, known)}")
        ax.plot(frames.index, frames[kind][name], lw=1, label=name)
    ax.set_xlabel("time, s")
    ax.set_ylabel({"q": "position, m or rad", "v": "velocity, m/s or rad/s", "tau": "torque, N m (force, N)"}[kind])
    ax.set_title(f"{policy}, particle {particle}")
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)
    return ax


def _policies(campaign: Campaign, policies: Union[None, str, Iterable[str]]) -> Sequence[str]:
    names = campaign.policies if policies is None else [policies] if isinstance(policies, str) else list(policies)
    for name in names:
        if name not in campaign.policies:
            raise CampaignError(f"{campaign.path}: has no policy '{name}'{nearest(name, campaign.policies)}")
    return names


def _axes(ax: Optional["Axes"], size: Tuple[float, float]) -> "Axes":
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=size, layout="constrained")[1]
