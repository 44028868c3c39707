"""What goes wrong in the program or the simulator."""


class GrazeError(Exception):
    """Graze refused or failed. `code`: the program's exit code (2: wrong input, 3: the machine); the text is what it said."""

    def __init__(self, code: int, text: str):
        super().__init__(text or f"graze ended with exit code {code}")
        self.code = code
