"""Interface files nobody wrote: made from the grammar, or by mutating others; fixed by a seed."""

import random

PRIMITIVES = (
    "bool byte char int8 uint8 int16 uint16 int32 uint32 int64 uint64 float32 float64 "
    "string wstring string<=5 wstring<=5"
).split()
MESSAGES = ["std_msgs/Header", "geometry_msgs/Point", "builtin_interfaces/Time", "Other"]
#: Types that are wrong, each for another reason.
BAD_TYPES = ["flot64", "time", "std_msgs/msg/Header", "string<=0", "int32<=4", "Nowhere", "a/b/C"]
ARRAYS = ["", "", "", "[]", "[2]", "[<=3]", "[<=0]", "[+2]", "[0x2]", "[2][2]"]
NAMES = "a b c d e f x1 long_name value class int self print module data_2".split()
BAD_NAMES = ["A", "a__b", "a_", "_a", "1a", "camelCase", "é"]
CONSTANTS = ["A", "B", "C", "MAX", "A_1", "X2Y", "TRUE", "NULL"]
COMMENTS = [
    "# plain",
    "#",
    "## two",
    "# speed [m/s]",
    "# [m] and [s]",
    "# [a, b] list",
    "#  indented",
    "# open [m",
    "# close ]",
    "# café 漢字",
    '# "quoted"',
    "# tab\tinside",
    "# trailing  ",
    r"# a\tb",
    r"# C:\Users",
    r"# \d \q",
    r"# \\theta",
    r"# ends \\",
]
NUMBERS = "0 1 5 127 -1 255 -129 3.5 1e3 0x1F 017 1_0 +2 1e400 x".split()
BOOLS = ["true", "FALSE", "0", "1", "yes"]
STRINGS = [
    '"text"',
    "'text'",
    "bare",
    '""',
    '"un',
    r'"a\"b"',
    r"'a\nb'",
    r'"a\tb"',
    r'"\\"',
    '"é"',
    "two words",
    '"too long for 5"',
    r'"\x41"',
    r'"\u00e9"',
    "'it''s'",
]
SPICE = [
    "#",
    "=",
    '"',
    "'",
    "[",
    "]",
    "<=",
    " ",
    "\t",
    "\\",
    "\n",
    "\r\n",
    "---",
    "-",
    "0",
    "a",
    "A",
]
SPICE += [
    "_",
    ",",
    "/",
    "é",
    "\u2028",
    "\x0b",
    "\ufeff",
    "\u00a0",
    "string<=3",
    "[<=2]",
    "[m]",
    "\\n",
]
SUFFIXES = {"msg": [""], "srv": ["", ""], "action": ["", "", ""]}


class Inventor:
    """Makes cases for rosidl_side.py; `known` are texts to mutate, by kind."""

    def __init__(self, seed, known):
        self.random = random.Random(seed)
        self.known = known

    def cases(self, count):
        return [self._case() for _ in range(count)]

    def _case(self):
        kind = self.random.choice(["msg", "msg", "msg", "srv", "action"])
        made = self.random.random() < 0.5
        text = self._file(kind) if made else self.random.choice(self.known[kind])
        if not made or self.random.random() < 0.25:
            for _ in range(self.random.choice([1, 1, 2, 3])):
                text = self._mutate(text)
        return {
            "kind": kind,
            "pkg": "invented",
            "name": "Case",
            "bytes_hex": text.encode("utf-8", "surrogatepass").hex(),
            "siblings": {"msg/Other.msg": "int32 x\n"},
        }

    def _file(self, kind):
        sections = {"msg": 1, "srv": 2, "action": 3}[kind]
        return "---\n".join(self._section() for _ in range(sections))

    def _section(self):
        lines = [self.random.choice(COMMENTS)] * (self.random.random() < 0.3)
        names, constants = NAMES[:], CONSTANTS[:]
        self.random.shuffle(names)
        self.random.shuffle(constants)
        for _ in range(self.random.randrange(5)):
            lines.append(self._line(names.pop(), constants.pop()))
        return "".join(f"{line}\n" for line in lines)

    def _line(self, name, constant):
        shape = self.random.random()
        if shape < 0.08:
            return self.random.choice(["", "  ", "\t", self.random.choice(COMMENTS)])
        if shape < 0.14:
            return "  " + self.random.choice(COMMENTS)
        tail = "  " + self.random.choice(COMMENTS) if self.random.random() < 0.3 else ""
        if shape < 0.4:
            type_ = self.random.choice(PRIMITIVES[:-2])
            equals = self.random.choice(["=", " = ", " ="])
            return f"{type_} {constant}{equals}{self._scalar(type_)}{tail}"
        return self._field(name) + tail

    def _field(self, name):
        odd = self.random.random()
        if odd < 0.03:
            name = self.random.choice(BAD_NAMES)
        if odd > 0.97:
            return f"{self.random.choice(BAD_TYPES)} {name}"
        if self.random.random() < 0.2:
            return f"{self.random.choice(MESSAGES)}{self.random.choice(ARRAYS[:6])} {name}"
        type_ = self.random.choice(PRIMITIVES)
        array = self.random.choice(ARRAYS if self.random.random() < 0.1 else ARRAYS[:6])
        default = ""
        if self.random.random() < 0.5:
            items = [self._scalar(type_) for _ in range(self.random.choice([2, 2, 2, 0, 1]))]
            default = f" [{', '.join(items)}]" if array else " " + self._scalar(type_)
        return f"{type_}{array} {name}{default}"

    def _scalar(self, type_):
        if "string" in type_:
            return self.random.choice(STRINGS)
        if type_ == "bool":
            return self.random.choice(BOOLS)
        return self.random.choice(NUMBERS[:4] if self.random.random() < 0.8 else NUMBERS)

    def _mutate(self, text):
        place = self.random.randrange(len(text) + 1)
        lines = text.splitlines(keepends=True) or [""]
        line = self.random.randrange(len(lines))
        match self.random.randrange(5):
            case 0:
                return text[:place] + text[place + 1 :]
            case 1:
                return text[:place] + self.random.choice(SPICE) + text[place:]
            case 2:
                return text[:place] + self.random.choice(SPICE) + text[place + 1 :]
            case 3:
                return "".join([*lines[:line], *lines[line + 1 :]])
            case _:
                other = self.random.choice(self.known["msg"]).splitlines(keepends=True) or [""]
                return "".join([*lines[:line], self.random.choice(other), *lines[line:]])
