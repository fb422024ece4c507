"""Every code that idlc can report, with its properties: stable, never renumbered, never reused.

A code's constant is called like its slug, and `explain/<id>.md` is its page.
"""

from __future__ import annotations

import msgspec

from idlc.diagnostics.report import Diagnostic, Edit, Label, Severity
from idlc.diagnostics.source import Span

ERROR = Severity.ERROR
WARNING = Severity.WARNING

CORRECTNESS = "correctness"
PORTABILITY = "portability"
STYLE = "style"
PACKAGE = "package"
#: Users select warnings by these.
CATEGORIES = (CORRECTNESS, PORTABILITY, STYLE, PACKAGE)


class Code(msgspec.Struct, frozen=True):
    """A kind of problem: its stable id, its short name, its severity and its category.

    `default`: `idlc check` reports it without being asked. Rules about names and the amount of
    documentation are off, and rules against code that works as well as its alternative.
    `usage`: a problem of the call or its environment, not of an interface; exit status 2.
    """

    id: str
    slug: str
    severity: Severity
    category: str = CORRECTNESS
    default: bool = True
    usage: bool = False

    @property
    def kind(self) -> str:
        """The severity and category, in words."""
        if self.severity is ERROR:
            return "error"
        return f"warning, {self.category}{'' if self.default else ', off by default'}"

    def at(
        self,
        span: Span | None,
        message: str,
        *,
        hint: str | None = None,
        labels: tuple[Label, ...] = (),
        edits: tuple[Edit, ...] = (),
    ) -> Diagnostic:
        """Return a problem of this kind at a location in a file; `None`: of what has no text."""
        return Diagnostic(
            code=self.id,
            severity=self.severity,
            message=message,
            span=span,
            hint=hint,
            labels=labels,
            edits=edits,
        )

    def of(
        self, path: str, message: str, *, hint: str | None = None, detail: str = "", place: str = ""
    ) -> Diagnostic:
        """Return a problem of this kind with a whole file or folder."""
        problem = self.at(None, message, hint=hint)
        return msgspec.structs.replace(problem, path=path, detail=detail, place=place)


# syntax
MISSING_NAME = Code("IDL101", "missing-name", ERROR)
INDENTED_DEFINITION = Code("IDL102", "indented-definition", ERROR)
MALFORMED_TYPE = Code("IDL103", "malformed-type", ERROR)
SEPARATOR_COUNT = Code("IDL104", "separator-count", ERROR)
MALFORMED_SEPARATOR = Code("IDL105", "malformed-separator", ERROR)
BYTE_ORDER_MARK = Code("IDL106", "byte-order-mark", ERROR)
BAD_ESCAPE = Code("IDL107", "bad-escape", ERROR)
UNIT_ACROSS_LINES = Code("IDL108", "unit-across-lines", ERROR)
HASH_IN_QUOTES = Code("IDL109", "hash-in-quotes", WARNING)
UNUSUAL_LINE_END = Code("IDL110", "unusual-line-end", WARNING)
OPTIONAL_WITHOUT_EFFECT = Code("IDL111", "optional-without-effect", WARNING)
OPTIONAL_NEEDS_LYRICAL = Code("IDL112", "optional-needs-lyrical", ERROR)
REPEATED_OPTIONAL = Code("IDL113", "repeated-optional", ERROR)
FOREIGN_IDL = Code("IDL114", "foreign-idl", ERROR)

# names and references
UNKNOWN_TYPE = Code("IDL201", "unknown-type", ERROR)
UNKNOWN_PACKAGE = Code("IDL202", "unknown-package", ERROR)
INVALID_FIELD_NAME = Code("IDL203", "invalid-field-name", ERROR)
INVALID_CONSTANT_NAME = Code("IDL204", "invalid-constant-name", ERROR)
INVALID_TYPE_NAME = Code("IDL205", "invalid-type-name", ERROR)
INVALID_INTERFACE_NAME = Code("IDL206", "invalid-interface-name", ERROR)
INVALID_PACKAGE_NAME = Code("IDL207", "invalid-package-name", ERROR)
DUPLICATE_FIELD = Code("IDL208", "duplicate-field", ERROR)
DUPLICATE_CONSTANT = Code("IDL209", "duplicate-constant", ERROR)
RECURSIVE_TYPE = Code("IDL210", "recursive-type", ERROR)
ROS1_TYPE = Code("IDL211", "ros1-type", ERROR)
PACKAGE_CIRCLE = Code("IDL212", "package-circle", ERROR)
BREAKS_ROSIDL_PYTHON = Code("IDL220", "breaks-rosidl-python", WARNING, PORTABILITY)
BREAKS_C = Code("IDL221", "breaks-c", WARNING, PORTABILITY)
BREAKS_CPP = Code("IDL222", "breaks-cpp", WARNING, PORTABILITY)
SAME_PYTHON_MODULE = Code("IDL223", "same-python-module", WARNING, PORTABILITY)

# types, bounds and values
BAD_BOUND = Code("IDL301", "bad-bound", ERROR)
BOUND_ON_NON_STRING = Code("IDL302", "bound-on-non-string", ERROR)
CONSTANT_TYPE = Code("IDL303", "constant-type", ERROR)
BAD_VALUE = Code("IDL304", "bad-value", ERROR)
OUT_OF_RANGE = Code("IDL305", "out-of-range", ERROR)
STRING_TOO_LONG = Code("IDL306", "string-too-long", ERROR)
DEFAULT_ON_MESSAGE = Code("IDL307", "default-on-message", ERROR)
ARRAY_VALUE = Code("IDL308", "array-value", ERROR)
ARRAY_LENGTH = Code("IDL309", "array-length", ERROR)
NON_FINITE_VALUE = Code("IDL310", "non-finite-value", WARNING)
MANGLED_TEXT = Code("IDL311", "mangled-text", WARNING)
WSTRING_SEQUENCE_BOUND = Code("IDL312", "wstring-sequence-bound", WARNING)
REPEATED_SECTION_CONSTANT = Code("IDL313", "repeated-section-constant", WARNING)
FLOAT32_RANGE = Code("IDL314", "float32-range", WARNING)
ODD_TEXT = Code("IDL315", "odd-text", WARNING)

# style
STAMPED_WITHOUT_HEADER = Code("IDL401", "stamped-without-header", WARNING, STYLE)
UNDOCUMENTED_INTERFACE = Code("IDL402", "undocumented-interface", WARNING, STYLE, default=False)
UNDOCUMENTED_FIELD = Code("IDL403", "undocumented-field", WARNING, STYLE, default=False)
MISSING_UNIT = Code("IDL404", "missing-unit", WARNING, STYLE, default=False)
UNUSUAL_UNIT = Code("IDL405", "unusual-unit", WARNING, STYLE)
CONSTANT_WITHOUT_PREFIX = Code("IDL406", "constant-without-prefix", WARNING, STYLE, default=False)
REDUNDANT_SUFFIX = Code("IDL407", "redundant-suffix", WARNING, STYLE, default=False)

# surprises of ROS 2's pipeline
SEVERAL_UNITS = Code("IDL411", "several-units", WARNING)

# portability
WIDE_STRING = Code("IDL421", "wide-string", WARNING, PORTABILITY)
CHAR_TYPE = Code("IDL422", "char-type", WARNING, PORTABILITY, default=False)
UNENFORCED_BOUND = Code("IDL423", "unenforced-bound", WARNING, PORTABILITY)
REMOVED_STANDARD_TYPE = Code("IDL424", "removed-standard-type", WARNING, PORTABILITY)
CHANGED_STANDARD_TYPE = Code("IDL425", "changed-standard-type", WARNING, PORTABILITY)

# the package around the interfaces
MISSING_DEPENDENCY = Code("IDL451", "missing-dependency", WARNING, PACKAGE)
UNUSED_DEPENDENCY = Code("IDL452", "unused-dependency", WARNING, PACKAGE)
NOT_IN_INTERFACE_GROUP = Code("IDL453", "not-in-interface-group", WARNING, PACKAGE)
NO_INTERFACE_GENERATORS = Code("IDL454", "no-interface-generators", WARNING, PACKAGE)
INTERFACES_NOT_INSTALLED = Code("IDL455", "interfaces-not-installed", WARNING, PACKAGE)
NO_RESOURCE_MARKER = Code("IDL456", "no-resource-marker", WARNING, PACKAGE)
BAD_ENTRY_POINT = Code("IDL457", "bad-entry-point", WARNING, PACKAGE)
NAME_MISMATCH = Code("IDL458", "name-mismatch", WARNING, PACKAGE)
UNDECLARED_IMPORT = Code("IDL459", "undeclared-import", WARNING, PACKAGE)
STALE_GENERATED_CODE = Code("IDL460", "stale-generated-code", WARNING, PACKAGE)
NO_LIBRARY_INSTALLED = Code("IDL461", "no-library-installed", WARNING, PACKAGE)
CLASSES_NOT_INSTALLED = Code("IDL462", "classes-not-installed", WARNING, PACKAGE)
MISSING_CMAKE_DEPENDENCY = Code("IDL463", "missing-cmake-dependency", WARNING, PACKAGE)
INTERFACE_NOT_GENERATED = Code("IDL464", "interface-not-generated", WARNING, PACKAGE)
MISSING_INTERFACE_FILE = Code("IDL465", "missing-interface-file", WARNING, PACKAGE)
MISSING_FIND_PACKAGE = Code("IDL466", "missing-find-package", WARNING, PACKAGE)
UNUSED_CMAKE_DEPENDENCY = Code("IDL467", "unused-cmake-dependency", WARNING, PACKAGE)
RUNTIME_NOT_EXPORTED = Code("IDL468", "runtime-not-exported", WARNING, PACKAGE)
DEPRECATED_ARGUMENT = Code("IDL469", "deprecated-argument", WARNING, PACKAGE)

# remarks
UNUSED_IGNORE = Code("IDL490", "unused-ignore", WARNING)
IGNORE_WITHOUT_REASON = Code("IDL491", "ignore-without-reason", WARNING)
ENUM_WITHOUT_CONSTANTS = Code("IDL492", "enum-without-constants", WARNING)
UNKNOWN_REMARK = Code("IDL493", "unknown-remark", WARNING)

# breaking changes
INTERFACE_REMOVED = Code("IDL501", "interface-removed", ERROR)
INTERFACE_RENAMED = Code("IDL502", "interface-renamed", ERROR)
FIELD_REMOVED = Code("IDL503", "field-removed", ERROR)
FIELD_RENAMED = Code("IDL504", "field-renamed", ERROR)
FIELD_ADDED = Code("IDL505", "field-added", ERROR)
FIELD_MOVED = Code("IDL506", "field-moved", ERROR)
FIELD_TYPE_CHANGED = Code("IDL507", "field-type-changed", ERROR)
FIELD_BOUND_CHANGED = Code("IDL508", "field-bound-changed", ERROR)
FIELD_DEFAULT_CHANGED = Code("IDL509", "field-default-changed", ERROR)
CONSTANT_REMOVED = Code("IDL510", "constant-removed", ERROR)
CONSTANT_RENAMED = Code("IDL511", "constant-renamed", ERROR)
CONSTANT_TYPE_CHANGED = Code("IDL512", "constant-type-changed", ERROR)
CONSTANT_VALUE_CHANGED = Code("IDL513", "constant-value-changed", ERROR)
UNIT_CHANGED = Code("IDL514", "unit-changed", ERROR)
USED_TYPE_CHANGED = Code("IDL515", "used-type-changed", ERROR)
HASH_CHANGED = Code("IDL516", "hash-changed", ERROR)
UNUSED_ALLOWANCE = Code("IDL517", "unused-allowance", WARNING)
EXPIRED_ALLOWANCE = Code("IDL518", "expired-allowance", WARNING)
OPTIONAL_ADDED = Code("IDL519", "optional-added", ERROR)
NOT_COMPARED = Code("IDL520", "not-compared", ERROR)
NOTHING_COMPARED = Code("IDL521", "nothing-compared", ERROR, usage=True)
SEVERAL_VERSIONS = Code("IDL530", "several-versions", ERROR)
SEVERAL_TYPES = Code("IDL531", "several-types", ERROR)

# files and projects
UNREADABLE = Code("IDL601", "unreadable", ERROR)
NO_SUCH_PATH = Code("IDL602", "no-such-path", ERROR, usage=True)
NOT_TEXT = Code("IDL603", "not-text", ERROR)
TOO_LARGE = Code("IDL604", "too-large", ERROR)
NOT_AN_INTERFACE = Code("IDL605", "not-an-interface", ERROR, usage=True)
NO_INTERFACES = Code("IDL606", "no-interfaces", ERROR, usage=True)
UNIMPORTABLE_PACKAGE = Code("IDL607", "unimportable-package", ERROR, usage=True)
SEVERAL_PACKAGES = Code("IDL608", "several-packages", ERROR, usage=True)
DUPLICATE_INTERFACE = Code("IDL609", "duplicate-interface", ERROR)
BAD_PACKAGE_XML = Code("IDL610", "bad-package-xml", ERROR, usage=True)
BAD_CONFIG = Code("IDL611", "bad-config", ERROR, usage=True)
CANNOT_WRITE = Code("IDL612", "cannot-write", ERROR, usage=True)
EDITED_FILE = Code("IDL613", "edited-file", ERROR)
FOREIGN_FILE = Code("IDL614", "foreign-file", ERROR)
BAD_LOCK = Code("IDL615", "bad-lock", ERROR, usage=True)
DRIFT = Code("IDL616", "drift", ERROR)
DEPENDENCY_NOT_IMPORTABLE = Code("IDL617", "dependency-not-importable", WARNING, PACKAGE)
NO_SUCH_TYPE = Code("IDL618", "no-such-type", ERROR, usage=True)
STRUCTURE_TOO_LARGE = Code("IDL619", "structure-too-large", ERROR, usage=True)
EXISTING_FILE = Code("IDL620", "existing-file", ERROR)
CANNOT_EDIT = Code("IDL621", "cannot-edit", ERROR)
UNREAD_FILE = Code("IDL622", "unread-file", WARNING)
NO_TYPE_HASHES = Code("IDL624", "no-type-hashes", ERROR, usage=True)
NO_SUCH_REVISION = Code("IDL630", "no-such-revision", ERROR, usage=True)
DUPLICATE_PACKAGE = Code("IDL631", "duplicate-package", ERROR, usage=True)
UNUSABLE_LIBRARY = Code("IDL632", "unusable-library", ERROR)
INCONSISTENT_INDEX = Code("IDL633", "inconsistent-index", ERROR)
NO_RCLPY = Code("IDL640", "no-rclpy", ERROR, usage=True)
EMPTY_GRAPH = Code("IDL641", "empty-graph", ERROR, usage=True)
NO_ANSWER = Code("IDL642", "no-answer", ERROR, usage=True)

# recordings
UNREADABLE_RECORDING = Code("IDL651", "unreadable-recording", ERROR)
MISSING_DEFINITION = Code("IDL652", "missing-definition", WARNING)
SEVERAL_DEFINITIONS = Code("IDL653", "several-definitions", ERROR)
RECORDED_HASH_DIFFERS = Code("IDL654", "recorded-hash-differs", WARNING)
NO_SUCH_TOPIC = Code("IDL655", "no-such-topic", ERROR, usage=True)
DAMAGED_RECORDING = Code("IDL656", "damaged-recording", ERROR)

# upgrades of recordings
RULE_NEEDED = Code("IDL661", "rule-needed", ERROR)
DATA_LOST = Code("IDL662", "data-lost", ERROR)
CONVERSION_FAILED = Code("IDL663", "conversion-failed", ERROR)
BAD_RULES = Code("IDL664", "bad-rules", ERROR)
STALE_RULE = Code("IDL665", "stale-rule", WARNING)
MISSING_RULE = Code("IDL666", "missing-rule", WARNING)
AMBIGUOUS_RULE = Code("IDL667", "ambiguous-rule", WARNING)

# idlc itself
INTERNAL_ERROR = Code("IDL901", "internal-error", ERROR)

#: All codes by id.
CODES = {code.id: code for code in tuple(globals().values()) if isinstance(code, Code)}

#: Ids of the codes that mean exit status 2.
USAGE = frozenset(code.id for code in CODES.values() if code.usage)

_BY_WORD = {
    word: code for code in CODES.values() for word in (code.id.lower(), code.id[3:], code.slug)
}


def find(word: str) -> Code | None:
    """Return the code of a word: its id in any case, the id's digits, or its name."""
    return _BY_WORD.get(word.lower().replace("_", "-"))
