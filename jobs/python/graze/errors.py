"""What goes wrong in the program or the simulator."""
from __future__ import annotations

import difflib
import operator
from typing import Iterable


def nearest(name: str, known: Iterable[str]) -> str:
    """What follows 'there is no …': the name that was meant, or all of them."""
    names = list(known)
    near = difflib.get_close_matches(name, names, 1)
    return f"; did you mean '{near[0]}'?" if near else f"; there are: {', '.join(names) or 'none'}"


class GrazeError(Exception):
    """Graze refused or failed. `code`: the program's exit code (2: wrong input, 3: the machine); the text is what it said."""

    def __init__(self, code: int, text: str):
        super().__init__(text or f"graze ended with exit code {code}")
        self.code = code


def whole(value: object, what: str) -> int:
    """A whole number, of Python or NumPy. Raises GrazeError."""
    try:
        return operator.index(value)  # type: ignore[call-overload,no-any-return,unused-ignore]
    except TypeError:
        raise GrazeError(2, f"{what} is a whole number, not {value!r}") from None
