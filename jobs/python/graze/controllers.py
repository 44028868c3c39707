"""Policies as `graze.run(policy=…)` and `graze.simulate(policy=…)` take them, in the words of a scenario."""
from __future__ import annotations

import difflib
import hashlib
import pathlib
import sys
from typing import Dict, List, Mapping, Tuple, Union

from .errors import GrazeError
from .source import pickled, source_of

# A controller: a class, which is made with (robot, settings), an object, or what a scenario says of a policy.
One = Union[type, object, Mapping[str, object]]
Policies = Union[One, Mapping[str, One]]

DEFAULT_CONTROL: Mapping[str, object] = {"torque": {}}
GIVEN = "_GivenToGraze"  # the class that stands for an object
OBJECT = '''


class {given}({name}):
    """The object that was given to graze.run(), with the attributes that it had."""

    def __init__(self, robot, settings):
        for name, value in {attributes}.items():
            object.__setattr__(self, name, value)
        if callable(getattr(self, "begin", None)):
            self.begin(robot)
'''


class WrittenPolicies:
    """Policies in a scenario's words, and the files that were written for them.

    settings   what stands under `policies` of a scenario
    own_code   all code of these policies was given as classes or objects, so that nobody else's is run
    files      those that were not there before
    """

    def __init__(self, given: Policies, folder: pathlib.Path):
        self._folder = folder
        self.files: List[pathlib.Path] = []
        self.own_code = True
        named = given if isinstance(given, Mapping) else {_class_of(given).__name__: given}
        if not named:
            raise GrazeError(2, "policy: is empty; it takes a class, an object, or a map of names to them or to settings")
        try:
            self.settings: Dict[str, object] = {str(name): self._one(one, str(name)) for name, one in named.items()}
        except BaseException:
            self.remove()
            raise

    def remove(self) -> None:
        """Takes the files back."""
        for file in self.files:
            file.unlink(missing_ok=True)
        if self.files and not any(self._folder.iterdir()):
            self._folder.rmdir()

    def _one(self, given: One, name: str) -> Dict[str, object]:
        if not isinstance(given, Mapping):
            return {"python": self._python(given, {}), "control": _control_of(given)}
        out = dict(given)
        python = out.get("python")
        if python is None or isinstance(python, str):
            self.own_code = self.own_code and not {"python", "library"} & set(out)
        elif not isinstance(python, Mapping):
            out["python"] = self._python(python, {})
            out.setdefault("control", _control_of(python))
        elif "class" in python and not isinstance(python["class"], str):
            rest = {key: value for key, value in python.items() if key != "class"}
            if "file" in rest:
                raise GrazeError(2, f"policy {name}: python has a class and a file; the name of the class goes with a file")
            out["python"] = self._python(python["class"], rest)
            out.setdefault("control", _control_of(python["class"]))
        elif "file" not in python:
            near = next((f"; did you mean 'class' for {key!r}?" for key in python if difflib.get_close_matches(str(key), ["class"])), "")
            raise GrazeError(2, f"policy {name}: python has neither a class nor a file{near}")
        else:
            self.own_code = False
        return out

    def _python(self, given: object, rest: Mapping[str, object]) -> Dict[str, object]:
        """The map under `python` of a class or an object, whose source is written."""
        if isinstance(given, (str, list, tuple)):
            raise GrazeError(2, f"policy: a class is meant, or an object of one, not {given!r}; of the scenario's own policies "
                                f"run() takes those that are named by policies={given!r}")
        made = _class_of(given)
        if not callable(getattr(made, "act", None)):
            raise GrazeError(2, f"policy: class {made.__name__} has no method act(self, observation, targets)")
        text, name = source_of(made), made.__name__
        if given is not made:
            attributes = ", ".join(
                f"{key!r}: {pickled(value, f'attribute {key} of {name}', made.__module__)}"
                for key, value in _attributes_of(given).items())
            text += OBJECT.format(given=GIVEN, name=name, attributes="{" + attributes + "}")
        out: Dict[str, object] = {"file": str(self._write(name, text)), "class": name if given is made else GIVEN}
        if sys.executable:
            out["interpreter"] = sys.executable
        return {**out, **rest}

    def _write(self, name: str, text: str) -> pathlib.Path:
        """Named by what it holds: a campaign that was made before keeps its own."""
        digest = hashlib.sha256(text.encode()).hexdigest()[:8]
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            file = self._folder.resolve() / f"{name}-{digest}.py"
            if not file.exists():
                file.write_text(text, encoding="utf-8")
                self.files.append(file)
        except OSError as error:
            raise GrazeError(3, f"{self._folder}: the policy's source cannot be written: {error.strerror}; output=… names another "
                                "folder") from error
        return file


def policies_folder(archive: pathlib.Path) -> pathlib.Path:
    """Where the source of policies is written: first.policies beside first.graze or first.h5."""
    return archive.with_suffix(".policies") if archive.suffix in (".graze", ".h5") else (
        archive.with_name(archive.name + ".policies"))


def needs_trust(written: WrittenPolicies, trust: bool) -> bool:
    """Whoever gives code of his own to be run trusts it."""
    return trust or (written.own_code and any("python" in one for one in written.settings.values()
                                              if isinstance(one, Mapping)))


def _attributes_of(given: object) -> Dict[str, object]:
    """An object's own, those in slots, too."""
    out: Dict[str, object] = {}
    for one in type(given).__mro__:
        slots = getattr(one, "__slots__", ())
        for name in [slots] if isinstance(slots, str) else slots:
            if name not in ("__dict__", "__weakref__") and hasattr(given, name):
                out[name] = getattr(given, name)
    return {**out, **getattr(given, "__dict__", {})}


def _class_of(given: object) -> type:
    return given if isinstance(given, type) else type(given)


def _control_of(given: object) -> Mapping[str, object]:
    """The tracker that a class asks for by its attribute `control`; else its targets' torques act."""
    control = getattr(given, "control", DEFAULT_CONTROL)
    if not isinstance(control, Mapping):
        raise GrazeError(2, f"policy: {_class_of(given).__name__}.control is {control!r}; it is a map such as "
                            "{'torque': {}} or {'joint_pd': {'kp': 20, 'kd': 0.5}}")
    return control


__all__: Tuple[str, ...] = ("One", "Policies", "WrittenPolicies", "needs_trust", "policies_folder")
