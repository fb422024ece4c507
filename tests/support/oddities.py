"""Interface files nobody would write: every shape of every construct, as odd as it comes.

A family of its own beside `inventions.py`, so that neither's seeds change what the other makes.
Most lines are sound, so that files are often accepted as a whole; a few are anything at all.
"""

import random

INTEGERS = {
    "int8": (-(2**7), 2**7 - 1),
    "uint8": (0, 2**8 - 1),
    "byte": (0, 2**8 - 1),
    "char": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1),
    "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint64": (0, 2**64 - 1),
}
REALS = ["float32", "float64"]
TEXTS = ["string", "wstring"]
# Of each construct: sound shapes first, then those that may be anything; one of each line end.
BOUNDS = ["", "", "<=8", "<=300"]
ODD_BOUNDS = "<=1|<= 8|<=08|<=+8|<=0|<=-1|<8|<=x".split("|")
SIZES = ["", "", "", "", "[]", "[]", "[3]", "[<=3]", "[1]"]
ODD_SIZES = "[03]|[ 3 ]|[<= 3]|[+3]|[0]|[<=0]|[-1]|[<3]|[x]|[3|3]|[][]|[3][3]|[1e1]|[=3]".split("|")
#: `@` is a sound number of the type.
WHOLE = "@|+@|-0|00|0@|0x1f|0X1F|0b11|0o17|017|1_0|1.0|1e2|true|'@'|\"@\"|- 1|1 2|1u|1L||@,|++1"
ODD_WHOLE = [*WHOLE.split("|"), "\u0661"]
REAL = "0|1.5|-1.5|+1.5|.5|5.|1e3|1E-3|-1e+3|0.1|1e16|1e15|5e-324|0.30000000000000004".split("|")
ODD_REAL = "1e400|-1e400|1e-400|3.5e38|inf|-inf|nan|NaN|infinity|1_0.5|0x1p3|1,5|1.5f|true".split(
    "|"
)
LOGIC = "true|false|True|FALSE|1|0".split("|")
ODD_LOGIC = 'tRuE|2|yes|on|"true"||truee'.split("|")
#: What texts are made of; quoting and escaping is piled on these.
PLAIN = [
    "a",
    "b c",
    "  ",
    ",",
    "[",
    "]",
    "{",
    "é",
    "漢字",
    "\U0001f600",
    "%",
    "$",
    "/",
    "@(x)",
    "@",
]
PIECES = [
    *PLAIN,
    "#",
    "=",
    "'",
    '"',
    "\\'",
    '\\"',
    "\\\\",
    "\\n",
    "\\t",
    "\\x41",
    "\\101",
    "\\u00e9",
]
PIECES += [
    "\\q",
    "\\",
    "\t",
    "a\u0301",
    "\u200b",
    "\x7f",
    "<=",
    "---",
    "@[if x]",
    "??/",
    "*/",
    "\\0",
]
PIECES += ["\\N", "\u00a0", "\ufeff", "\\r", "\\f", "\\x0", "\\U0001f600", "\\?", '""', "''"]
QUOTES = [('"', '"'), ("'", "'")]
ODD_QUOTES = [
    ("", ""),
    ('"', ""),
    ("", "'"),
    ("'", '"'),
    ('""', '""'),
    ("''", "''"),
    ("\"'", "'\""),
]
ODD_QUOTES += [('"""', '"""'), ('\\"', '\\"')]
COMMENT = (
    "#|# text|#text|##|# [m]|# [m/s] speed|# a [m] b [s]|# [m|# m]|# []|# [[m]]|# [ m ]|# [a, b]"
)
COMMENT = [
    *COMMENT.split("|"),
    "# [a,b] [m]",
    "# é [µm]",
    "#\t[m]",
    "# [m]\t",
    '# "x"',
    "# '",
    '# """',
]
COMMENT += [
    "# {{ x }}",
    "# @x",
    "#\u3000x",
    "#   deep",
    "# \U0001f600",
    "# a\u0301",
    "# */",
    "# ??/",
]
COMMENT += [
    "# " + "long " * 60,
    "# \x7f",
    "# %s",
    "# ",
    "#  \t",
    r"# a\tb",
    r"# \\x",
    r"# \101 \x41",
]
ODD_COMMENT = [
    r"# \ ",
    r"# \q",
    r"# \x4",
    r"# \u12",
    r"# \N{x}",
    r"# \v",
    r"# \x0c",
    '# \\"',
    "# \\\\",
]
ODD_COMMENT += [r"# \N{BULLET}", r"# \u00e9", r"# \xc3\xa9", "# \\", "# [a\\]", "# [\u00e9\\x]"]
NAMES = [f"f{number}" for number in range(30)]
ODD_NAMES = (
    "a_1|a1_b2|x|in|class|none|true|string|msg|header|data|Request|é|a-b|a.b|a__b|_a|a_|1a|aB|A"
)
ODD_NAMES = [
    *ODD_NAMES.split("|"),
    "a" * 60,
    "a b",
    "a\u0301",
    "int8",
    "self",
    "module",
    "struct",
    "a/b",
]
ODD_NAMES += ["structure_needs_at_least_one_member", "sequence", "union", "const", "f0", "f1"]
CONSTANTS = [f"C{number}" for number in range(30)]
ODD_CONSTANTS = "A|A_1|A1_B2|a|A__B|_A|A_|1A|É|Ab|TRUE|NONE|STRUCT|f1|C0|C1".split("|")
REFERENCES = "Other|invented/Other|std_msgs/Header|geometry_msgs/Pose|builtin_interfaces/Time|Twin"
REFERENCES = [
    *REFERENCES.split("|"),
    "builtin_interfaces/Duration",
    "invented/Twin",
    "std_msgs/Empty",
]
ODD_REFERENCES = "Case|invented/Case|Missing|invented/Missing|other|Invented/Other|Header|msg/Other"
ODD_REFERENCES += (
    "|invented/msg/Other|/Other|Other/|std_msgs/|std_msgs/Nothing|Call|invented/Call|time"
)
ODD_REFERENCES += (
    "|example_interfaces/AddTwoInts|Case_Request|duration|Int8|INT8|int128|float|double"
)
ODD_REFERENCES = [*ODD_REFERENCES.split("|"), "str", "Other<=3", "std_msgs//Header", "a-b/C"]
SIBLINGS = {
    "msg/Other.msg": "int32 x\n",
    "msg/Twin.msg": "Other other\nstring<=3[2] x\n",
    "srv/Other.srv": "---\n",
    "srv/Call.srv": "Other a\n---\nTwin b\n",
}
BLANKS = ["", " ", "   ", "\t", "\u00a0", "\u3000", "\x0b", "\x0c", "\x1c"]
SEPARATORS = "--- |---  # text|----| ---|--|---\t|- - -|---x|===|\ufeff---".split("|")
LINE_ENDS = ["\n"] * 5 + ["\r\n"]
ODD_LINE_ENDS = ["\r", "\u2028", "\x85", "\x0b", "\x1c"]
INTERFACES = "C|CASE|Case2|CaseA1b|A2B|ABc|Case_x|case|É|Case_Request".split("|")
SECTIONS = {"msg": 1, "srv": 2, "action": 3}


class Oddities:
    """Makes cases for rosidl_side.py; `odd` is how often something is not sound."""

    def __init__(self, seed):
        self.random = random.Random(f"oddities {seed}")
        self.odd = 0.0

    def cases(self, count):
        return [self._case() for _ in range(count)]

    def _case(self):
        choice = self.random.choice
        self.odd = choice([0.0, 0.01, 0.02, 0.05, 0.1, 0.2])
        kind = choice(["msg", "msg", "msg", "srv", "action"])
        end = self._pick(LINE_ENDS, ODD_LINE_ENDS)
        lines = self._lines(kind)
        text = end.join(lines) + choice([end, end, end, ""])
        if self._is_odd(0.5):
            text = text.replace(end, choice(ODD_LINE_ENDS), 1)
        if self._is_odd(0.5):
            text = "\ufeff" + text
        data = text.encode("utf-8", "surrogatepass")
        if self._is_odd(0.3):
            at = self.random.randrange(len(data) + 1)
            data = data[:at] + choice([b"\xff", b"\0", b"\xed\xa0\x80", b"\x1a"]) + data[at:]
        name = self._pick(["Case"], INTERFACES)
        return {
            "kind": kind,
            "pkg": "invented",
            "name": name,
            "bytes_hex": data.hex(),
            "siblings": SIBLINGS,
        }

    def _is_odd(self, share=1.0):
        return self.random.random() < self.odd * share

    def _pick(self, sound, odd):
        return self.random.choice(odd if self._is_odd() else sound)

    def _lines(self, kind):
        names, constants = NAMES[:], CONSTANTS[:]
        separator = lambda: self._pick(["---"], SEPARATORS)  # noqa: E731
        lines = []
        count = SECTIONS[kind] + (self._is_odd() and self.random.choice([-1, 1, 2]))
        for number in range(count):
            lines += [separator()] if number else []
            if self.random.random() < 0.3:
                lines += [self._comment() for _ in range(self.random.randrange(1, 4))]
                lines += [""] * self.random.randrange(3)
            if self.random.random() < 0.3:  # each section may use the same names again
                names, constants = NAMES[:], CONSTANTS[:]
            for _ in range(self.random.choice([0, 1, 1, 2, 3])):
                lines += self._definition(names.pop(0), constants.pop(0))
        return lines

    def _definition(self, name, constant):
        blank = lambda: self._pick([" ", "  ", "\t"], BLANKS)  # noqa: E731
        before = [self._comment() for _ in range(self.random.choice([0, 0, 0, 1, 2]))]
        after = []
        line = self._pick([""], BLANKS)
        if self.random.random() < 0.4:
            line += self._constant(self._pick([constant], ODD_CONSTANTS), blank)
        else:
            line += self._field(self._pick([name], ODD_NAMES), blank)
        if self.random.random() < 0.4:
            line += self.random.choice(["", " ", "  ", "\t"]) + self._comment()
            if self.random.random() < 0.4:
                after = ["  " + self._comment() for _ in range(self.random.randrange(1, 3))]
        elif self.random.random() < 0.1:
            line += blank()
        if self.random.random() < 0.1:
            after += [self.random.choice(BLANKS[:4])]
        return [*before, line, *after]

    def _comment(self):
        return self._pick(COMMENT, ODD_COMMENT)

    def _constant(self, name, blank):
        type_ = self.random.choice([*INTEGERS, *REALS, *TEXTS, *TEXTS, "bool"])
        if self._is_odd():
            type_ += self.random.choice(["<=5", "[]", "[2]", "/x"])
        equals = self._pick(["=", " = ", "= ", " ="], ["==", ":=", " ", "", "=\t", "= ="])
        return f"{type_}{blank()}{name}{equals}{self._value(type_)}"

    def _field(self, name, blank):
        if self.random.random() < 0.2:
            type_ = self._pick(REFERENCES, ODD_REFERENCES)
            default = blank() + self._value("int8") if self._is_odd() else ""
            return f"{type_}{self._size()}{blank()}{name}{default}"
        type_ = self.random.choice([*INTEGERS, *REALS, *TEXTS, *TEXTS, *TEXTS, "bool"])
        bound = self._pick(BOUNDS, ODD_BOUNDS) if type_ in TEXTS else ""
        size = self._size()
        default = ""
        if self.random.random() < 0.5:
            value = self._array(type_, size) if size else self._value(type_)
            default = blank() + value
        return f"{type_}{bound}{size}{blank()}{name}{default}"

    def _size(self):
        return self._pick(SIZES, ODD_SIZES)

    def _array(self, type_, size):
        count = 3 if "3" in size and "<" not in size else 1 if "1" in size else 2
        if self._is_odd(3):
            count = self.random.randrange(6)
        between = self._pick([",", ", "], [",,", ";", " ", "\t,", ", ,", " , "])
        items = between.join(self._value(type_) for _ in range(count))
        opening, closing = self._pick(
            [("[", "]"), ("[ ", " ]")], [("", ""), ("(", ")"), ("[", ""), ("[[", "]]"), ("[", ",]")]
        )
        return opening + items + closing

    def _value(self, type_):
        if type_ in INTEGERS:
            low, high = INTEGERS[type_]
            sound = [low, high, 0, 1, self.random.randint(low, high)]
            number = self._pick(sound, [low - 1, high + 1, 10**30])
            return self._pick(["@"], ODD_WHOLE).replace("@", str(number))
        if type_ in REALS:
            return self._pick(REAL, ODD_REAL)
        if type_ == "bool":
            return self._pick(LOGIC, ODD_LOGIC)
        return self._text()

    def _text(self):
        """Return a text in quotes or bare, with quotes and escapes piled up in it."""
        choice = self.random.choice
        pieces = PIECES if self._is_odd(4) else PLAIN
        body = "".join(choice(pieces) for _ in range(choice([0, 1, 1, 1, 2, 3, 6])))
        opening, closing = self._pick(QUOTES, ODD_QUOTES)
        for _ in range(choice([0, 0, 0, 0, 1, 2])):  # escaped once more
            if len(body) < 60:
                body = body.replace("\\", "\\\\").replace('"', '\\"').replace("'", "\\'")
        return opening + body + closing
