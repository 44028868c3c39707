"""Runs a controller in Python for Graze, all lanes of a block in one call (docs/controllers.md).

Graze holds this text and starts it by `python3 -c`. It has two descriptors: a socket, and the memory that both processes
share. The first thing that comes through the socket is the setup, a line of JSON, which is answered by "k"; then each byte
asks for one control step, and is answered by a byte: done (128 + the number of the request modulo 128, so that nobody else
answers in its place by chance), or "e": an exception was raised, which the memory tells ("c": because of the class).
"""
import difflib
import faulthandler
import inspect
import json
import mmap
import os
import re
import signal
import sys
import traceback
import types
import warnings

SOCKET, MEMORY = 3, 4
OWN_NAME = "<graze>"  # in tracebacks, which leave these lines out
STAGE_LOAD, STAGE_CREATE, STAGE_RESET, STAGE_ACT = 1, 2, 3, 4  # as LibraryCall


class Settings(dict):
    """What the scenario says under `settings`. A key that is not there is told with its nearest."""

    def __missing__(self, key):
        raise KeyError(Told(unknown(key, sorted(map(str, self)), "the settings have no")))


class Told(str):
    """A text that KeyError shows as it stands, not between quotes."""

    def __repr__(self):
        return str(self)


class Names(list):
    """Names of joints or links. One that is not there is told with its nearest."""

    def __init__(self, what, names):
        super().__init__(names)
        self._what = what

    def index(self, name, *range_):
        try:
            return super().index(name, *range_)
        except ValueError:
            raise ValueError(unknown(name, self, f"the robot has no {self._what}")) from None


class Robot:
    """The nominal robot: what a controller may know of it before it sees anything."""

    def __init__(self, setup, np):
        self.lanes = setup["lanes"]          # robots per call, and one that never acts if there are 8 joints
        self.period = setup["period"]        # s, between two calls of act() for a lane
        self.joint_names = Names("driven joint", setup["joints"])  # in the order of all arrays
        self.link_names = Names("link", setup["links"])            # in the order of link_force and link_push
        self.slides = np.array(setup["slides"], dtype=bool)  # [joints]: True: m and N; False: rad and N m
        for name in ("lower", "upper", "effort", "speed", "initial"):
            setattr(self, name, np.array(setup[name], dtype=np.float64))  # [joints]
        self.urdf = setup["urdf"]            # its text; "" where Graze has none at hand

    def __getattr__(self, name):
        raise AttributeError(unknown(name, sorted(vars(self)), "the robot has no"))


class Observation:
    """What is sensed, as arrays [quantity, lane]; lanes that do not act hold old values. What the controller does not
    name under `reads` is not sensed, and is an error to look at rather than NaN."""

    def __setattr__(self, name, value):
        raise AttributeError(f"observation.{name} cannot be replaced: the observation is shared by all robots and steps; "
                             "compute with a variable of your own")

    def __getattr__(self, name):
        unread = self.__dict__.get("_unread", {})
        if name in unread:
            raise AttributeError(f"observation.{name} is not sensed, since the class's reads = {unread[name]} does not "
                                 f"name it; add '{name}' to reads, or leave reads out to have all")
        raise AttributeError(unknown(name, sorted(one for one in vars(self) if one != "_unread"),
                                     "the observation has no"))


class Targets:
    """What is wanted, as arrays [joint, lane]: targets.torque[:] = … and targets.torque = … are the same."""

    def __init__(self, arrays):
        object.__setattr__(self, "_arrays", arrays)

    def __getattr__(self, name):
        if name in self._arrays:
            return self._arrays[name]
        raise AttributeError(unknown(name, list(self._arrays), "targets have no"))

    def __setattr__(self, name, value):
        array = self.__getattr__(name)
        if not isinstance(value, (int, float)):
            value = sys.modules["numpy"].asarray(value)
            if value.dtype.kind not in "biuf":
                raise TypeError(f"targets.{name} takes real numbers, and this is {described(value)} of {value.dtype}")
        array[...] = value


def unknown(name, names, what):
    """'targets have no torqe; did you mean torque? There are: …'."""
    near = difflib.get_close_matches(str(name), names, 1)
    meant = f"; did you mean {near[0]}?" if near else ";"
    return f"{what} '{name}'{meant} there are: {', '.join(names) or 'none'}"


def wrong_class(text):
    """An error of what the scenario calls the class."""
    error = AttributeError(text)
    error.of_class = True
    return error


def load(path, name):
    """The class of that name in a file, which is run like an imported module, its own folder first on the path."""
    sys.path.insert(0, os.path.dirname(path))
    module = types.ModuleType(os.path.splitext(os.path.basename(path))[0])
    module.__file__ = path
    sys.modules[module.__name__] = module
    with open(path, "rb") as file:
        code = compile(file.read(), path, "exec")
    exec(code, module.__dict__)
    found = getattr(module, name, None)
    if not isinstance(found, type):
        classes = [key for key, value in vars(module).items() if isinstance(value, type)]
        raise wrong_class(unknown(name, classes, f"{os.path.basename(path)} has no class"))
    if not callable(getattr(found, "act", None)):
        raise wrong_class(f"class {name} has no method act(self, observation, targets)")
    for method, arguments in METHODS.items():
        check_method(name, method, arguments, inspect.getattr_static(found, method, None))
    return found


def is_bare(found):
    """Whether a class has no __init__ of its own, and so takes no arguments."""
    return found.__init__ is object.__init__ and found.__new__ is object.__new__


METHODS = {"act": ("observation", "targets"), "__init__": ("robot", "settings"), "reset": ("lanes", "seeds")}


def check_method(name, method, arguments, function):
    """Refuses a method that cannot be called with its arguments. What is no plain function is left alone."""
    if not isinstance(function, types.FunctionType):
        return
    signature = inspect.signature(function, follow_wrapped=False)
    try:
        signature.bind("self", *arguments)
    except TypeError:
        raise wrong_class(f"class {name} has {method}{signature}, and {method}(self, {', '.join(arguments)}) is wanted") \
            from None


class Session:
    """One controller, and the memory that it sees and fills."""

    def __init__(self, setup):
        import numpy as np

        self.np = np
        dropped = getattr(getattr(np, "exceptions", np), "ComplexWarning", None)
        if dropped is not None:  # what is not real is a mistake
            warnings.filterwarnings("error", category=dropped)
        self.memory = mmap.mmap(MEMORY, setup["size"])
        at = setup["offsets"]
        self.file = setup["file"]
        self.begun = self.array(np.int64, at["begun"], 1)
        self.stage = self.array(np.int64, at["stage"], 1)
        self.reads = self.array(np.int64, at["reads"], 1)
        self.message = self.array(np.int64, at["message_size"], 1), at["message"], setup["message_room"]
        self.lanes = self.array(np.int64, at["lanes"], setup["robots"])
        self.seeds = self.array(np.uint64, at["seeds"], setup["robots"])
        self.observation = self.view(setup, at)
        self.targets = Targets(
            {name: self.block(place, rows, setup["lanes"]) for name, place, rows in setup["targets"]})
        self.stage[0] = STAGE_LOAD
        made = load(self.file, setup["class"])
        reads = getattr(made, "reads", None)
        self.reads[0] = self.groups(reads, setup["observation"])
        self.hide_unread(reads, setup["observation"])
        self.stage[0] = STAGE_CREATE
        self.controller = made() if is_bare(made) else made(Robot(setup, np), Settings(setup["settings"]))
        self.arithmetic = arithmetic()  # as its libraries have left it, the same for all robots
        self.reset = getattr(self.controller, "reset", None)

    def array(self, kind, offset, count):
        return self.np.frombuffer(self.memory, dtype=kind, count=count, offset=offset)

    def block(self, offset, rows, lanes):
        return self.array(self.np.float64, offset, rows * lanes).reshape(rows, lanes)

    def view(self, setup, at):
        out = Observation()
        for name, place, rows, _ in setup["observation"]:
            vars(out)[name] = self.block(place, rows, setup["lanes"])
        vars(out)["time"] = self.array(self.np.float64, at["time"], setup["lanes"])
        vars(out)["active"] = self.array(self.np.bool_, at["active"], setup["lanes"])
        for array in vars(out).values():
            array.flags.writeable = False
        return out

    @staticmethod
    def groups(reads, fields):
        """The bits of the groups that a controller reads; None: all."""
        bits = {name: bit for name, _, _, bit in fields}
        out = 0
        for name in bits if reads is None else [reads] if isinstance(reads, str) else reads:
            if name not in bits:
                raise ValueError(unknown(name, list(bits), "reads: there is no"))
            out |= bits[name]
        return out

    def hide_unread(self, reads, fields):
        """What stays NaN because of `reads` raises when it is looked at."""
        seen = vars(self.observation)
        unread = [name for name, _, _, bit in fields if not int(self.reads[0]) & bit]
        for name in unread:
            del seen[name]
        seen["_unread"] = dict.fromkeys(unread, repr(reads))

    def step(self):
        count = int(self.begun[0])
        if count:
            self.stage[0] = STAGE_RESET
            if self.reset is not None:
                self.reset(self.lanes[:count].copy(), self.seeds[:count].copy())
        self.stage[0] = STAGE_ACT
        returned = self.controller.act(self.observation, self.targets)
        if arithmetic() != self.arithmetic:
            raise ArithmeticError("the controller changed the floating-point environment (rounding, or what becomes of "
                                  "the smallest numbers), which later robots would feel")
        if returned is not None:
            raise TypeError(f"act() returned {described(returned)}; it returns nothing, and fills targets.position, "
                            "targets.velocity or targets.torque instead")

    def tell(self, text):
        size, place, room = self.message
        data = text.encode("utf-8", "replace")[:room]
        self.memory[place:place + len(data)] = data
        size[0] = len(data)


def arithmetic(one=1.0, two=2.0, three=3.0, smallest=sys.float_info.min):
    """What the floating-point environment does: each direction of rounding, and numbers that are not normal."""
    return one / three, -one / three, two / three, smallest / two


def described(value):
    """'an array of shape (12, 8)', 'an object of type dict'."""
    shape = getattr(value, "shape", None)
    return f"an array of shape {shape}" if isinstance(shape, tuple) else f"an object of type {type(value).__name__}"


def is_users(file, controller):
    """Whether a file stands in the folder of the controller or below it, and is of no package installed there."""
    folder = os.path.join(os.path.dirname(controller), "")
    return file.startswith(folder) and not {"site-packages", "dist-packages"} & set(file[len(folder):].split(os.sep))


def told_in_one(error):
    """'SyntaxError: invalid syntax', without the lines of the file that Python quotes before it."""
    lines = traceback.format_exception_only(type(error), error)
    if isinstance(error, SyntaxError):
        lines = [line for line in lines if not line.startswith(" ")]
    return "".join(lines).strip()


def said_by(error):
    """What an error says; "" of one that cannot."""
    try:
        return str(error)
    except BaseException:  # the user's own class of errors
        return ""


def shape_hint(error, lanes):
    """What is wrong with an array that does not go with those of Graze."""
    told = said_by(error)
    if not isinstance(error, ValueError) or "broadcast" not in told:
        return ""
    shapes = [tuple(map(int, re.findall(r"\d+", one))) for one in re.findall(r"\([\d,]+\)", told)]
    fitting = [one for one in shapes if one[-1:] == (lanes,)]
    ours = shapes[-1] if "into shape" in told and shapes[-1:] == fitting[-1:] else next(iter(fitting), None)
    theirs = next((one for one in shapes if one != ours), None)
    if ours is None or theirs is None:
        return ""
    begin = f"; arrays of Graze are [quantity, lane] with {lanes} lanes"
    if len(fitting) > 1 and "into shape" not in told:  # either may be the user's
        return begin
    if len(ours) == 1:
        return f"{begin}, so that one quantity takes {lanes} values, or one number for all"
    if theirs == ours[::-1]:
        return f"{begin}, and this one is transposed: .T turns it"
    if theirs == ours[:1]:
        return f"{begin}, so that one value for each quantity wants [:, None] behind it"
    return f"{begin}, here of shape {ours}, and this one is of shape {theirs}"


def number_hint(error):
    """What is wrong where an array of lanes is taken for one number, as by `if`, float() or math.sin()."""
    told = said_by(error)
    if isinstance(error, ValueError) and "truth value of an array" in told:
        return "; arrays of Graze, time among them, have a value for each lane: np.where chooses lane by lane in place of 'if'"
    if isinstance(error, TypeError) and ("-1 arrays can be converted" in told or "0-dimensional arrays can be converted" in told):
        return "; arrays of Graze, time among them, have a value for each lane: functions of NumPy (np.sin) take them whole"
    return ""


def explain(error, setup):
    """Prints the traceback, from the controller's first line on; returns it in one line, with the user's innermost line."""
    controller = setup["file"]
    told = traceback.TracebackException.from_exception(error)
    frames = [frame for frame in told.stack if frame.filename != OWN_NAME and not frame.filename.startswith("<frozen")]
    told.stack = traceback.StackSummary.from_list(frames)
    print("".join(told.format()), end="", file=sys.stderr, flush=True)
    places = [(frame.filename, frame.lineno) for frame in frames]
    if isinstance(error, SyntaxError) and error.filename and error.lineno:
        places.append((error.filename, error.lineno))
    own = [place for place in places if is_users(place[0], controller)] or places
    place = f" ({os.path.basename(own[-1][0])}:{own[-1][1]})" if own else ""
    return told_in_one(error) + place + shape_hint(error, setup["lanes"]) + number_hint(error)


def read_setup():
    line = b""
    while not line.endswith(b"\n"):
        piece = os.read(SOCKET, 1 << 16)
        if not piece:
            os._exit(0)
        line += piece
    return json.loads(line.decode("utf-8", "surrogateescape"))


def leave_copies(own):
    """Ends a copy that the controller made by fork(): it would answer, too."""
    if os.getpid() != own:
        os._exit(0)


def pass_over(number, frame):
    """Signals that are meant for the campaign end no controller. Other than if they were ignored, they do end a program
    that the controller starts."""


def main():
    own = os.getpid()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGXCPU):
        signal.signal(number, pass_over)
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR1)  # what Graze sends before it ends a controller that does not come back
    setup = read_setup()
    session = Session.__new__(Session)
    try:
        session.__init__(setup)
    except BaseException as error:  # SystemExit, too
        leave_copies(own)
        text = explain(error, setup)
        if not hasattr(session, "message"):  # NumPy is not there
            os.write(SOCKET, b"n")
            os._exit(1)
        session.tell(text)
        os.write(SOCKET, b"c" if getattr(error, "of_class", False) else b"e")
        os._exit(1)
    leave_copies(own)
    os.write(SOCKET, b"k")
    request = 0
    while os.read(SOCKET, 1):
        request = (request + 1) % 128
        try:
            session.step()
        except BaseException as error:
            leave_copies(own)
            session.tell(explain(error, setup))
            os.write(SOCKET, b"e")
        else:
            leave_copies(own)
            os.write(SOCKET, bytes([128 + request]))
    os._exit(0)  # threads that it has left running do not matter any more


main()
