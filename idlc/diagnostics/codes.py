"""Every code that idlc can report: stable, never renumbered, never reused.

1xx syntax, 2xx names and references, 3xx types, bounds and values, 4xx advice, 5xx breaking
changes, 6xx files and projects, 9xx idlc itself. `explain/<id>.md` holds each one's page.
"""

from __future__ import annotations

import msgspec

from idlc.diagnostics.report import Diagnostic, Label, Severity
from idlc.diagnostics.source import Span

ERROR = Severity.ERROR
WARNING = Severity.WARNING


class Code(msgspec.Struct, frozen=True):
    """A kind of problem: its stable id, its short name and how bad it is."""

    id: str
    slug: str
    severity: Severity

    def at(
        self, span: Span, message: str, *, hint: str | None = None, labels: tuple[Label, ...] = ()
    ) -> Diagnostic:
        """Return a problem of this kind at a place in a file."""
        return Diagnostic(
            code=self.id,
            severity=self.severity,
            message=message,
            span=span,
            hint=hint,
            labels=labels,
        )

    def of(
        self, path: str, message: str, *, hint: str | None = None, detail: str = ""
    ) -> Diagnostic:
        """Return a problem of this kind with a whole file or folder."""
        return Diagnostic(
            code=self.id,
            severity=self.severity,
            message=message,
            path=path,
            hint=hint,
            detail=detail,
        )


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

# names and references
UNKNOWN_TYPE = Code("IDL201", "unknown-type", ERROR)
UNKNOWN_PACKAGE = Code("IDL202", "unknown-package", ERROR)
FIELD_NAME = Code("IDL203", "invalid-field-name", ERROR)
CONSTANT_NAME = Code("IDL204", "invalid-constant-name", ERROR)
TYPE_NAME = Code("IDL205", "invalid-type-name", ERROR)
INTERFACE_NAME = Code("IDL206", "invalid-interface-name", ERROR)
PACKAGE_NAME = Code("IDL207", "invalid-package-name", ERROR)
DUPLICATE_FIELD = Code("IDL208", "duplicate-field", ERROR)
DUPLICATE_CONSTANT = Code("IDL209", "duplicate-constant", ERROR)
RECURSIVE_TYPE = Code("IDL210", "recursive-type", ERROR)
ROS1_TYPE = Code("IDL211", "ros1-type", ERROR)
PACKAGE_CIRCLE = Code("IDL212", "package-circle", ERROR)
BREAKS_PYTHON = Code("IDL220", "breaks-rosidl-python", WARNING)
BREAKS_C = Code("IDL221", "breaks-c", WARNING)
BREAKS_CPP = Code("IDL222", "breaks-cpp", WARNING)
SAME_MODULE = Code("IDL223", "same-python-module", WARNING)

# types, bounds and values
BAD_BOUND = Code("IDL301", "bad-bound", ERROR)
BOUND_ON_NON_STRING = Code("IDL302", "bound-on-non-string", ERROR)
CONSTANT_TYPE = Code("IDL303", "constant-type", ERROR)
BAD_VALUE = Code("IDL304", "bad-value", ERROR)
OUT_OF_RANGE = Code("IDL305", "out-of-range", ERROR)
STRING_TOO_LONG = Code("IDL306", "string-too-long", ERROR)
MESSAGE_DEFAULT = Code("IDL307", "default-on-message", ERROR)
ARRAY_VALUE = Code("IDL308", "array-value", ERROR)
ARRAY_LENGTH = Code("IDL309", "array-length", ERROR)
NON_FINITE = Code("IDL310", "non-finite-value", WARNING)
MANGLED_TEXT = Code("IDL311", "mangled-text", WARNING)
WSTRING_BOUND = Code("IDL312", "wstring-sequence-bound", WARNING)
CONSTANT_MOVED = Code("IDL313", "repeated-section-constant", WARNING)
FLOAT32_RANGE = Code("IDL314", "float32-range", WARNING)
ODD_TEXT = Code("IDL315", "odd-text", WARNING)

# style
STAMPED_WITHOUT_HEADER = Code("IDL401", "stamped-without-header", WARNING)
UNDOCUMENTED_INTERFACE = Code("IDL402", "undocumented-interface", WARNING)
UNDOCUMENTED_FIELD = Code("IDL403", "undocumented-field", WARNING)
MISSING_UNIT = Code("IDL404", "missing-unit", WARNING)
UNUSUAL_UNIT = Code("IDL405", "unusual-unit", WARNING)
CONSTANT_PREFIX = Code("IDL406", "constant-without-prefix", WARNING)
REDUNDANT_SUFFIX = Code("IDL407", "redundant-suffix", WARNING)

# surprises of ROS 2's pipeline
SEVERAL_UNITS = Code("IDL411", "several-units", WARNING)

# portability
WIDE_STRING = Code("IDL421", "wide-string", WARNING)
CHAR_TYPE = Code("IDL422", "char-type", WARNING)
NESTED_BOUND = Code("IDL423", "unenforced-bound", WARNING)

# the package around the interfaces
MISSING_DEPENDENCY = Code("IDL451", "missing-dependency", WARNING)
UNUSED_DEPENDENCY = Code("IDL452", "unused-dependency", WARNING)
NO_INTERFACE_GROUP = Code("IDL453", "not-in-interface-group", WARNING)
NO_GENERATORS = Code("IDL454", "no-interface-generators", WARNING)
NOT_INSTALLED = Code("IDL455", "interfaces-not-installed", WARNING)
NO_RESOURCE_MARKER = Code("IDL456", "no-resource-marker", WARNING)
BAD_ENTRY_POINT = Code("IDL457", "bad-entry-point", WARNING)
NAME_MISMATCH = Code("IDL458", "name-mismatch", WARNING)
UNDECLARED_IMPORT = Code("IDL459", "undeclared-import", WARNING)
STALE_OUTPUT = Code("IDL460", "stale-generated-code", WARNING)
NO_LIBRARY = Code("IDL461", "no-library-installed", WARNING)

# remarks that silence others
UNUSED_IGNORE = Code("IDL490", "unused-ignore", WARNING)
IGNORE_WITHOUT_REASON = Code("IDL491", "ignore-without-reason", WARNING)

# breaking changes
INTERFACE_REMOVED = Code("IDL501", "interface-removed", ERROR)
INTERFACE_RENAMED = Code("IDL502", "interface-renamed", ERROR)
FIELD_REMOVED = Code("IDL503", "field-removed", ERROR)
FIELD_RENAMED = Code("IDL504", "field-renamed", ERROR)
FIELD_ADDED = Code("IDL505", "field-added", ERROR)
FIELD_MOVED = Code("IDL506", "field-moved", ERROR)
FIELD_TYPE = Code("IDL507", "field-type-changed", ERROR)
FIELD_BOUND = Code("IDL508", "field-bound-changed", ERROR)
FIELD_DEFAULT = Code("IDL509", "field-default-changed", ERROR)
CONSTANT_REMOVED = Code("IDL510", "constant-removed", ERROR)
CONSTANT_RENAMED = Code("IDL511", "constant-renamed", ERROR)
CONSTANT_RETYPED = Code("IDL512", "constant-type-changed", ERROR)
CONSTANT_VALUE = Code("IDL513", "constant-value-changed", ERROR)
UNIT_CHANGED = Code("IDL514", "unit-changed", ERROR)
USED_TYPE = Code("IDL515", "used-type-changed", ERROR)
HASH_CHANGED = Code("IDL516", "hash-changed", ERROR)
UNUSED_ALLOWANCE = Code("IDL517", "unused-allowance", WARNING)
EXPIRED_ALLOWANCE = Code("IDL518", "expired-allowance", WARNING)

# files and projects
UNREADABLE = Code("IDL601", "unreadable", ERROR)
NO_SUCH_PATH = Code("IDL602", "no-such-path", ERROR)
NOT_TEXT = Code("IDL603", "not-text", ERROR)
TOO_LARGE = Code("IDL604", "too-large", ERROR)
NOT_AN_INTERFACE = Code("IDL605", "not-an-interface", ERROR)
NO_INTERFACES = Code("IDL606", "no-interfaces", ERROR)
UNIMPORTABLE = Code("IDL607", "unimportable-package", ERROR)
SEVERAL_PACKAGES = Code("IDL608", "several-packages", ERROR)
DUPLICATE_INTERFACE = Code("IDL609", "duplicate-interface", ERROR)
BAD_PACKAGE_XML = Code("IDL610", "bad-package-xml", ERROR)
BAD_CONFIG = Code("IDL611", "bad-config", ERROR)
CANNOT_WRITE = Code("IDL612", "cannot-write", ERROR)
EDITED_FILE = Code("IDL613", "edited-file", ERROR)
FOREIGN_FILE = Code("IDL614", "foreign-file", ERROR)
BAD_LOCK = Code("IDL615", "bad-lock", ERROR)
DRIFT = Code("IDL616", "drift", ERROR)
NOT_IMPORTABLE = Code("IDL617", "dependency-not-importable", WARNING)
NO_SUCH_TYPE = Code("IDL618", "no-such-type", ERROR)
STRUCTURE_TOO_LARGE = Code("IDL619", "structure-too-large", ERROR)
EXISTING_FILE = Code("IDL620", "existing-file", ERROR)
CANNOT_EDIT = Code("IDL621", "cannot-edit", ERROR)
UNREAD_FILE = Code("IDL622", "unread-file", WARNING)
BROKEN_TEMPLATE = Code("IDL623", "broken-template", ERROR)
NO_REVISION = Code("IDL630", "no-such-revision", ERROR)
DUPLICATE_PACKAGE = Code("IDL631", "duplicate-package", ERROR)
UNUSABLE_LIBRARY = Code("IDL632", "unusable-library", ERROR)

# idlc itself
INTERNAL = Code("IDL901", "internal-error", ERROR)

#: Codes that blame the call or its surroundings rather than an interface file: exit status 2.
USAGE: frozenset[str] = frozenset(
    code.id
    for code in (
        NO_SUCH_PATH,
        NOT_AN_INTERFACE,
        NO_INTERFACES,
        UNIMPORTABLE,
        SEVERAL_PACKAGES,
        BAD_PACKAGE_XML,
        BAD_CONFIG,
        CANNOT_WRITE,
        BAD_LOCK,
        NO_SUCH_TYPE,
        STRUCTURE_TOO_LARGE,
        BROKEN_TEMPLATE,
        NO_REVISION,
        DUPLICATE_PACKAGE,
    )
)

#: All codes by id.
CODES: dict[str, Code] = {
    code.id: code for code in tuple(globals().values()) if isinstance(code, Code)
}

_BY_WORD = {
    word: code for code in CODES.values() for word in (code.id.lower(), code.id[3:], code.slug)
}


def find(word: str) -> Code | None:
    """Return the code that a word means: its id in any case, the id's digits, or its name."""
    return _BY_WORD.get(word.lower().replace("_", "-"))
