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


class DiagnosticCode(msgspec.Struct, frozen=True):
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
MISSING_NAME = DiagnosticCode("IDL101", "missing-name", ERROR)
INDENTED_DEFINITION = DiagnosticCode("IDL102", "indented-definition", ERROR)
MALFORMED_TYPE = DiagnosticCode("IDL103", "malformed-type", ERROR)
SEPARATOR_COUNT = DiagnosticCode("IDL104", "separator-count", ERROR)
MALFORMED_SEPARATOR = DiagnosticCode("IDL105", "malformed-separator", ERROR)
BYTE_ORDER_MARK = DiagnosticCode("IDL106", "byte-order-mark", ERROR)
BAD_ESCAPE = DiagnosticCode("IDL107", "bad-escape", ERROR)
UNIT_ACROSS_LINES = DiagnosticCode("IDL108", "unit-across-lines", ERROR)
HASH_IN_QUOTES = DiagnosticCode("IDL109", "hash-in-quotes", WARNING)
UNUSUAL_LINE_END = DiagnosticCode("IDL110", "unusual-line-end", WARNING)
OPTIONAL_WITHOUT_EFFECT = DiagnosticCode("IDL111", "optional-without-effect", WARNING)
OPTIONAL_NEEDS_LYRICAL = DiagnosticCode("IDL112", "optional-needs-lyrical", ERROR)
REPEATED_OPTIONAL = DiagnosticCode("IDL113", "repeated-optional", ERROR)
FOREIGN_IDL = DiagnosticCode("IDL114", "foreign-idl", ERROR)

# names and references
UNKNOWN_TYPE = DiagnosticCode("IDL201", "unknown-type", ERROR)
UNKNOWN_PACKAGE = DiagnosticCode("IDL202", "unknown-package", ERROR)
INVALID_FIELD_NAME = DiagnosticCode("IDL203", "invalid-field-name", ERROR)
INVALID_CONSTANT_NAME = DiagnosticCode("IDL204", "invalid-constant-name", ERROR)
INVALID_TYPE_NAME = DiagnosticCode("IDL205", "invalid-type-name", ERROR)
INVALID_INTERFACE_NAME = DiagnosticCode("IDL206", "invalid-interface-name", ERROR)
INVALID_PACKAGE_NAME = DiagnosticCode("IDL207", "invalid-package-name", ERROR)
DUPLICATE_FIELD = DiagnosticCode("IDL208", "duplicate-field", ERROR)
DUPLICATE_CONSTANT = DiagnosticCode("IDL209", "duplicate-constant", ERROR)
RECURSIVE_TYPE = DiagnosticCode("IDL210", "recursive-type", ERROR)
ROS1_TYPE = DiagnosticCode("IDL211", "ros1-type", ERROR)
PACKAGE_CIRCLE = DiagnosticCode("IDL212", "package-circle", ERROR)
BREAKS_ROSIDL_PYTHON = DiagnosticCode("IDL220", "breaks-rosidl-python", WARNING, PORTABILITY)
BREAKS_C = DiagnosticCode("IDL221", "breaks-c", WARNING, PORTABILITY)
BREAKS_CPP = DiagnosticCode("IDL222", "breaks-cpp", WARNING, PORTABILITY)
SAME_PYTHON_MODULE = DiagnosticCode("IDL223", "same-python-module", WARNING, PORTABILITY)

# types, bounds and values
BAD_BOUND = DiagnosticCode("IDL301", "bad-bound", ERROR)
BOUND_ON_NON_STRING = DiagnosticCode("IDL302", "bound-on-non-string", ERROR)
CONSTANT_TYPE = DiagnosticCode("IDL303", "constant-type", ERROR)
BAD_VALUE = DiagnosticCode("IDL304", "bad-value", ERROR)
OUT_OF_RANGE = DiagnosticCode("IDL305", "out-of-range", ERROR)
STRING_TOO_LONG = DiagnosticCode("IDL306", "string-too-long", ERROR)
DEFAULT_ON_MESSAGE = DiagnosticCode("IDL307", "default-on-message", ERROR)
ARRAY_VALUE = DiagnosticCode("IDL308", "array-value", ERROR)
ARRAY_LENGTH = DiagnosticCode("IDL309", "array-length", ERROR)
NON_FINITE_VALUE = DiagnosticCode("IDL310", "non-finite-value", WARNING)
MANGLED_TEXT = DiagnosticCode("IDL311", "mangled-text", WARNING)
WSTRING_SEQUENCE_BOUND = DiagnosticCode("IDL312", "wstring-sequence-bound", WARNING)
REPEATED_SECTION_CONSTANT = DiagnosticCode("IDL313", "repeated-section-constant", WARNING)
FLOAT32_RANGE = DiagnosticCode("IDL314", "float32-range", WARNING)
ODD_TEXT = DiagnosticCode("IDL315", "odd-text", WARNING)

# style
STAMPED_WITHOUT_HEADER = DiagnosticCode("IDL401", "stamped-without-header", WARNING, STYLE)
UNDOCUMENTED_INTERFACE = DiagnosticCode(
    "IDL402", "undocumented-interface", WARNING, STYLE, default=False
)
UNDOCUMENTED_FIELD = DiagnosticCode("IDL403", "undocumented-field", WARNING, STYLE, default=False)
MISSING_UNIT = DiagnosticCode("IDL404", "missing-unit", WARNING, STYLE, default=False)
UNUSUAL_UNIT = DiagnosticCode("IDL405", "unusual-unit", WARNING, STYLE)
CONSTANT_WITHOUT_PREFIX = DiagnosticCode(
    "IDL406", "constant-without-prefix", WARNING, STYLE, default=False
)
REDUNDANT_SUFFIX = DiagnosticCode("IDL407", "redundant-suffix", WARNING, STYLE, default=False)

# surprises of ROS 2's pipeline
SEVERAL_UNITS = DiagnosticCode("IDL411", "several-units", WARNING)

# portability
WIDE_STRING = DiagnosticCode("IDL421", "wide-string", WARNING, PORTABILITY)
CHAR_TYPE = DiagnosticCode("IDL422", "char-type", WARNING, PORTABILITY, default=False)
UNENFORCED_BOUND = DiagnosticCode("IDL423", "unenforced-bound", WARNING, PORTABILITY)
REMOVED_STANDARD_TYPE = DiagnosticCode("IDL424", "removed-standard-type", WARNING, PORTABILITY)
CHANGED_STANDARD_TYPE = DiagnosticCode("IDL425", "changed-standard-type", WARNING, PORTABILITY)

# the package around the interfaces
MISSING_DEPENDENCY = DiagnosticCode("IDL451", "missing-dependency", WARNING, PACKAGE)
UNUSED_DEPENDENCY = DiagnosticCode("IDL452", "unused-dependency", WARNING, PACKAGE)
NOT_IN_INTERFACE_GROUP = DiagnosticCode("IDL453", "not-in-interface-group", WARNING, PACKAGE)
NO_INTERFACE_GENERATORS = DiagnosticCode("IDL454", "no-interface-generators", WARNING, PACKAGE)
INTERFACES_NOT_INSTALLED = DiagnosticCode("IDL455", "interfaces-not-installed", WARNING, PACKAGE)
NO_RESOURCE_MARKER = DiagnosticCode("IDL456", "no-resource-marker", WARNING, PACKAGE)
BAD_ENTRY_POINT = DiagnosticCode("IDL457", "bad-entry-point", WARNING, PACKAGE)
NAME_MISMATCH = DiagnosticCode("IDL458", "name-mismatch", WARNING, PACKAGE)
UNDECLARED_IMPORT = DiagnosticCode("IDL459", "undeclared-import", WARNING, PACKAGE)
STALE_GENERATED_CODE = DiagnosticCode("IDL460", "stale-generated-code", WARNING, PACKAGE)
NO_LIBRARY_INSTALLED = DiagnosticCode("IDL461", "no-library-installed", WARNING, PACKAGE)
CLASSES_NOT_INSTALLED = DiagnosticCode("IDL462", "classes-not-installed", WARNING, PACKAGE)
MISSING_CMAKE_DEPENDENCY = DiagnosticCode("IDL463", "missing-cmake-dependency", WARNING, PACKAGE)
INTERFACE_NOT_GENERATED = DiagnosticCode("IDL464", "interface-not-generated", WARNING, PACKAGE)
MISSING_INTERFACE_FILE = DiagnosticCode("IDL465", "missing-interface-file", WARNING, PACKAGE)
MISSING_FIND_PACKAGE = DiagnosticCode("IDL466", "missing-find-package", WARNING, PACKAGE)
UNUSED_CMAKE_DEPENDENCY = DiagnosticCode("IDL467", "unused-cmake-dependency", WARNING, PACKAGE)
RUNTIME_NOT_EXPORTED = DiagnosticCode("IDL468", "runtime-not-exported", WARNING, PACKAGE)
DEPRECATED_ARGUMENT = DiagnosticCode("IDL469", "deprecated-argument", WARNING, PACKAGE)
CANNOT_BUILD = DiagnosticCode("IDL470", "cannot-build", WARNING, PACKAGE)

# remarks
UNUSED_IGNORE = DiagnosticCode("IDL490", "unused-ignore", WARNING)
IGNORE_WITHOUT_REASON = DiagnosticCode("IDL491", "ignore-without-reason", WARNING)
ENUM_WITHOUT_CONSTANTS = DiagnosticCode("IDL492", "enum-without-constants", WARNING)
UNKNOWN_REMARK = DiagnosticCode("IDL493", "unknown-remark", WARNING)

# breaking changes
INTERFACE_REMOVED = DiagnosticCode("IDL501", "interface-removed", ERROR)
INTERFACE_RENAMED = DiagnosticCode("IDL502", "interface-renamed", ERROR)
FIELD_REMOVED = DiagnosticCode("IDL503", "field-removed", ERROR)
FIELD_RENAMED = DiagnosticCode("IDL504", "field-renamed", ERROR)
FIELD_ADDED = DiagnosticCode("IDL505", "field-added", ERROR)
FIELD_MOVED = DiagnosticCode("IDL506", "field-moved", ERROR)
FIELD_TYPE_CHANGED = DiagnosticCode("IDL507", "field-type-changed", ERROR)
FIELD_BOUND_CHANGED = DiagnosticCode("IDL508", "field-bound-changed", ERROR)
FIELD_DEFAULT_CHANGED = DiagnosticCode("IDL509", "field-default-changed", ERROR)
CONSTANT_REMOVED = DiagnosticCode("IDL510", "constant-removed", ERROR)
CONSTANT_RENAMED = DiagnosticCode("IDL511", "constant-renamed", ERROR)
CONSTANT_TYPE_CHANGED = DiagnosticCode("IDL512", "constant-type-changed", ERROR)
CONSTANT_VALUE_CHANGED = DiagnosticCode("IDL513", "constant-value-changed", ERROR)
UNIT_CHANGED = DiagnosticCode("IDL514", "unit-changed", ERROR)
USED_TYPE_CHANGED = DiagnosticCode("IDL515", "used-type-changed", ERROR)
HASH_CHANGED = DiagnosticCode("IDL516", "hash-changed", ERROR)
UNUSED_ALLOWANCE = DiagnosticCode("IDL517", "unused-allowance", WARNING)
EXPIRED_ALLOWANCE = DiagnosticCode("IDL518", "expired-allowance", WARNING)
OPTIONAL_ADDED = DiagnosticCode("IDL519", "optional-added", ERROR)
NOT_COMPARED = DiagnosticCode("IDL520", "not-compared", ERROR)
NOTHING_COMPARED = DiagnosticCode("IDL521", "nothing-compared", ERROR, usage=True)
SEVERAL_VERSIONS = DiagnosticCode("IDL530", "several-versions", ERROR)
SEVERAL_TYPES = DiagnosticCode("IDL531", "several-types", ERROR)

# files and projects
UNREADABLE = DiagnosticCode("IDL601", "unreadable", ERROR)
NO_SUCH_PATH = DiagnosticCode("IDL602", "no-such-path", ERROR, usage=True)
NOT_TEXT = DiagnosticCode("IDL603", "not-text", ERROR)
TOO_LARGE = DiagnosticCode("IDL604", "too-large", ERROR)
NOT_AN_INTERFACE = DiagnosticCode("IDL605", "not-an-interface", ERROR, usage=True)
NO_INTERFACES = DiagnosticCode("IDL606", "no-interfaces", ERROR, usage=True)
UNIMPORTABLE_PACKAGE = DiagnosticCode("IDL607", "unimportable-package", ERROR, usage=True)
SEVERAL_PACKAGES = DiagnosticCode("IDL608", "several-packages", ERROR, usage=True)
DUPLICATE_INTERFACE = DiagnosticCode("IDL609", "duplicate-interface", ERROR)
BAD_PACKAGE_XML = DiagnosticCode("IDL610", "bad-package-xml", ERROR, usage=True)
BAD_CONFIG = DiagnosticCode("IDL611", "bad-config", ERROR, usage=True)
CANNOT_WRITE = DiagnosticCode("IDL612", "cannot-write", ERROR, usage=True)
EDITED_FILE = DiagnosticCode("IDL613", "edited-file", ERROR)
FOREIGN_FILE = DiagnosticCode("IDL614", "foreign-file", ERROR)
BAD_LOCK = DiagnosticCode("IDL615", "bad-lock", ERROR, usage=True)
DRIFT = DiagnosticCode("IDL616", "drift", ERROR)
DEPENDENCY_NOT_IMPORTABLE = DiagnosticCode("IDL617", "dependency-not-importable", WARNING, PACKAGE)
NO_SUCH_TYPE = DiagnosticCode("IDL618", "no-such-type", ERROR, usage=True)
STRUCTURE_TOO_LARGE = DiagnosticCode("IDL619", "structure-too-large", ERROR, usage=True)
EXISTING_FILE = DiagnosticCode("IDL620", "existing-file", ERROR)
CANNOT_EDIT = DiagnosticCode("IDL621", "cannot-edit", ERROR)
UNREAD_FILE = DiagnosticCode("IDL622", "unread-file", WARNING)
NO_TYPE_HASHES = DiagnosticCode("IDL624", "no-type-hashes", ERROR, usage=True)
NO_SUCH_REVISION = DiagnosticCode("IDL630", "no-such-revision", ERROR, usage=True)
DUPLICATE_PACKAGE = DiagnosticCode("IDL631", "duplicate-package", ERROR, usage=True)
UNUSABLE_LIBRARY = DiagnosticCode("IDL632", "unusable-library", ERROR)
INCONSISTENT_INDEX = DiagnosticCode("IDL633", "inconsistent-index", ERROR)
NO_RCLPY = DiagnosticCode("IDL640", "no-rclpy", ERROR, usage=True)
EMPTY_GRAPH = DiagnosticCode("IDL641", "empty-graph", ERROR, usage=True)
NO_ANSWER = DiagnosticCode("IDL642", "no-answer", ERROR, usage=True)

# recordings
UNREADABLE_RECORDING = DiagnosticCode("IDL651", "unreadable-recording", ERROR)
MISSING_DEFINITION = DiagnosticCode("IDL652", "missing-definition", WARNING)
SEVERAL_DEFINITIONS = DiagnosticCode("IDL653", "several-definitions", ERROR)
RECORDED_HASH_DIFFERS = DiagnosticCode("IDL654", "recorded-hash-differs", WARNING)
NO_SUCH_TOPIC = DiagnosticCode("IDL655", "no-such-topic", ERROR, usage=True)
DAMAGED_RECORDING = DiagnosticCode("IDL656", "damaged-recording", ERROR)

# upgrades of recordings
RULE_NEEDED = DiagnosticCode("IDL661", "rule-needed", ERROR)
DATA_LOST = DiagnosticCode("IDL662", "data-lost", ERROR)
CONVERSION_FAILED = DiagnosticCode("IDL663", "conversion-failed", ERROR)
BAD_RULES = DiagnosticCode("IDL664", "bad-rules", ERROR)
STALE_RULE = DiagnosticCode("IDL665", "stale-rule", WARNING)
MISSING_RULE = DiagnosticCode("IDL666", "missing-rule", WARNING)
AMBIGUOUS_RULE = DiagnosticCode("IDL667", "ambiguous-rule", WARNING)

# idlc itself
INTERNAL_ERROR = DiagnosticCode("IDL901", "internal-error", ERROR)

#: All codes by id.
CODES = {code.id: code for code in tuple(globals().values()) if isinstance(code, DiagnosticCode)}

#: Ids of the codes that mean exit status 2.
USAGE = frozenset(code.id for code in CODES.values() if code.usage)

_BY_WORD = {
    word: code for code in CODES.values() for word in (code.id.lower(), code.id[3:], code.slug)
}


def find(word: str) -> DiagnosticCode | None:
    """Return the code of a word: its id in any case, the id's digits, or its name."""
    return _BY_WORD.get(word.lower().replace("_", "-"))
