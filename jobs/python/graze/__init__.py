"""Graze from Python: campaigns are run by the program `graze`, and read as tables of pandas; blocks are simulated step by step.

>>> import graze
>>> campaign = graze.run("quadruped_curb", n=100)
>>> campaign.counts()
>>> failed = campaign.traces("step/3cm").query("outcome != 'success'")
>>> campaign.telemetry("step/3cm", failed.index[0])
>>> for block in graze.simulate("quadruped_curb", [17], policy="step/3cm"):
...     print(block.time, block.row("q", "base.z"))

docs/python.md tells more; docs/archive.md has the meaning and unit of every column.
"""
from .block import Block, Contacts, simulate
from .campaign import Campaign, CampaignError
from .errors import GrazeError
from .program import find_program, run
from .shipped import PathLike


def open(path: PathLike) -> Campaign:
    """A campaign's directory or packed file (.h5). Nothing but its description is read yet.

    Raises CampaignError if it is no campaign, is damaged, or lacks shards that its manifest names.
    """
    return Campaign(path)


__all__ = ["Block", "Campaign", "CampaignError", "Contacts", "GrazeError", "find_program", "open", "run", "simulate"]
__version__ = "0.1.0"
