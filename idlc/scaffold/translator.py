"""Nodes that translate between two versions of interfaces, and need no idlc where they run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import msgspec

from idlc.compare.breaking import GIT
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.text import did_you_mean, one_line
from idlc.generate.python.render import carried_runtime
from idlc.model import derive, ir, python_names
from idlc.model.link import Model
from idlc.model.names import snake_case
from idlc.project.settings import Scope
from idlc.project.templates import Code, RenderedFile, Text
from idlc.recordings.definitions import interface_of
from idlc.scaffold.roles import DEFAULT_QOS, Endpoint, Qos, Role, endpoint_name
from idlc.scaffold.spec import Translation
from idlc.upgrading.plan import FieldPlan, Key, Plan, Step, Version, is_list, make_plan
from idlc.upgrading.rules import TYPES, Known, Rules, read_rules, rule_files
from idlc.upgrading.stubs import home_files, type_files
from idlc.upgrading.targets import compiled, target_of

#: The folder, in the package of a node, of classes and rules of other versions.
FOLDER = "versions"

#: What the translation of a service imports besides.
_WAITING = {"rclpy.callback_groups": ("ReentrantCallbackGroup",), "typing": ("Any",)}


class Topic(NamedTuple):
    """An interface, and the names of the topic or service for its old and new versions."""

    type: str
    name: str
    new_name: str
    qos: Qos = DEFAULT_QOS


class Request(NamedTuple):
    """A requested translation: the old and the new version as the command line names them."""

    versions: tuple[str, str]
    topics: tuple[Topic, ...]
    rules: tuple[str, ...] = ()


class Translated(NamedTuple):
    """The endpoints of a translator, and the files that it needs in its package."""

    endpoints: tuple[Endpoint, ...]
    translations: tuple[Translation, ...]
    conversion: ConversionView
    files: Mapping[str, str]

    @property
    def home(self) -> str:
        """The module through which both versions are imported."""
        return f"{FOLDER}/__init__.py"

    @property
    def types(self) -> str:
        """The folder of the files that nobody edits."""
        return f"{FOLDER}/{TYPES}"

    @property
    def open(self) -> list[str]:
        """The functions that a person has to complete."""
        raises = "raise NotImplementedError"
        functions = self.conversion.functions
        return [each.name for each in functions if any(raises in line for line in each.lines)]


class _ImportView(NamedTuple):
    module: Code
    name: Code


class _FunctionView(NamedTuple):
    """A function of the conversion; each line is a statement or a comment."""

    name: Code
    old: Code
    new: Code
    lines: tuple[Code | Text, ...]


class ConversionView(NamedTuple):
    """The content of a module of conversions; `rules` are the modules of rules that it calls."""

    node: Code
    imports: tuple[_ImportView, ...]
    exported: tuple[Code, ...]
    rules: tuple[Code, ...]
    functions: tuple[_FunctionView, ...]


def topic(text: str, node: str, qos: Qos = DEFAULT_QOS) -> Topic:
    """Return what `TYPE:NAME:NEW_NAME` means; raise ValueError if versions would meet."""
    type_, *names = text.split(":")
    if not type_ or len(names) not in (1, 2):
        shape = "TYPE:NAME:NEW_NAME, such as `my_msgs/Drive:drive:drive_v2`"
        raise ValueError(f"`{text}` is not {shape}")
    old, new = (endpoint_name(name).replace("~", node) for name in (names[0], names[-1]))
    if old.lstrip("/") == new.lstrip("/"):
        raise ValueError(
            f"both versions of `{type_}` would use the name `{old}`: nodes of different versions "
            "would find each other and misread each other's messages; choose another name for the "
            f"new version, such as `{type_}:{old}:{old}_v2`"
        )
    return Topic(type_, old, new, qos)


def translate(
    node: str, package: str, request: Request, scope: Scope, report: Report
) -> Translated | None:
    """Return the parts of a node that translates from one version to another."""
    versions, topics = request.versions, request.topics
    names = [_name(each.type, package) for each in topics]
    found: list[tuple[list[ir.TypeName], Mapping[str, Model]]] = []
    for side, other in (versions, versions[::-1]):
        # a revision of what the other one names
        paths = scope.paths if other.startswith(("git:", "distro:")) else (other,)
        place = msgspec.structs.replace(scope, paths=paths) if side.startswith(GIT) else scope
        with target_of(side, place, report) as target:
            if target is None or report.had_errors:
                return None
            compiler = target.compiler({})
            library = compiler.library
            known = [
                next((each for each in kinds if library.source(each) is not None), None)
                for kinds in names
            ]
            for each, name in zip(topics, known, strict=True):
                if name is None:
                    near = did_you_mean(each.type, [f"{n.package}/{n.name}" for n in target.texts])
                    message = f"no such message or service in `{side}`: `{each.type}`"
                    report.add(codes.NO_SUCH_TYPE.of("", message, hint=near))
            chosen = [name for name in known if name is not None]
            models = None if report.had_errors else compiled(compiler, set(chosen), report)
            if models is None:
                return None
            found.append((chosen, models))
    files, bad = read_rules(rule_files(request.rules, scope.root), scope.root, report)
    report.extend(codes.BAD_RULES.at(error.span, str(error)) for error in bad)
    writer = _Writer(node, Known(files))
    parts = [
        writer.translate(each, old, new, found[0][1], found[1][1], report)
        for each, old, new in zip(topics, found[0][0], found[1][0], strict=True)
    ]
    if report.had_errors:
        return None
    imported = tuple(name for part in parts for name in part if name.isidentifier())
    tested = tuple(name for part in parts for name in part[:2])
    module = f"{package}.{node}_conversion"
    role = Role("translator", None, "", "", "translates", "translator", imports={module: imported})
    role = role._replace(test_imports={module: tested})
    waiting = role._replace(imports={**role.imports, **_WAITING}, helpers=frozenset({"pause"}))
    endpoints = tuple(
        Endpoint(waiting if part.back else role, each.type, each.name, qos=each.qos)
        for each, part in zip(topics, parts, strict=True)
    )
    return Translated(endpoints, tuple(parts), writer.view, dict(writer.files))


def _name(text: str, own: str) -> tuple[ir.TypeName, ...]:
    """Return the message and the service that the type of an option may be."""
    parts = text.split("/")
    package = parts[0] if len(parts) > 1 else own
    kinds: tuple[ir.Kind, ...] = ("msg", "srv")
    return tuple(
        ir.TypeName(package, kind, parts[-1])
        for kind in kinds
        if len(parts) <= 2 or (len(parts) == 3 and parts[1] == kind)
    )


class _Side(NamedTuple):
    """One of the versions: the prefix of its classes, and the folder of their packages."""

    label: str
    home: str


class _Writer:
    """Collects the functions, imports and files of a translator."""

    def __init__(self, node: str, rules: Known) -> None:
        self._node = node
        self._known = rules
        self._sides = (_Side("Old", f"{node}_old"), _Side("New", f"{node}_new"))
        self._imports: dict[tuple[str, str], None] = {}
        self._exported: dict[str, None] = {}
        self._rules: dict[str, None] = {}
        self._functions: dict[tuple[Key, Key, _Side, _Side], _FunctionView] = {}
        self._names: dict[str, object] = {}
        self._plans: list[Plan] = []
        self._reached: dict[_Side, tuple[set[ir.TypeName], Mapping[str, Model]]] = {}

    def translate(
        self,
        topic: Topic,
        name: ir.TypeName,
        new_name: ir.TypeName,
        before: Mapping[str, Model],
        after: Mapping[str, Model],
        report: Report,
    ) -> Translation:
        """Return a translation; add what it needs."""
        sections = [
            derive.sections(models[each.package].interfaces[each])
            for models, each in ((before, name), (after, new_name))
        ]
        pairs = [
            (Version(before, old.name), Version(after, new.name))
            for old, new in zip(*sections, strict=True)
        ]
        if all(old.key == new.key for old, new in pairs):
            message = f"`{topic.type}` is equal in both versions"
            hint = "connect the nodes directly: `topic_tools relay` copies messages between topics"
            report.add(codes.NO_SUCH_TYPE.of("", message, hint=hint))
        old_side, new_side = self._sides
        for side, models, *versions in zip(self._sides, (before, after), *pairs, strict=True):
            reached = self._reached.setdefault(side, (set(), models))[0]
            for version in versions:
                reached.update(map(interface_of, version.reached))
        convert = self._function(make_plan(*pairs[0], self._known), old_side, new_side)
        back = ""
        if len(pairs) > 1:
            old, new = pairs[1]
            back = self._function(make_plan(new, old, self._known), new_side, old_side)
        classes = [
            self._class(side, each) for side, each in ((old_side, name), (new_side, new_name))
        ]
        for exported in (*classes, convert, back):
            self._exported.setdefault(exported)
        texts = (*classes, convert, back, repr(topic.new_name))
        return Translation(*map(Code, texts))

    @property
    def view(self) -> ConversionView:
        """The module of all functions."""
        imports = sorted(self._imports, key=lambda pair: tuple(map(str.lower, pair)))
        return ConversionView(
            Code(self._node),
            tuple(_ImportView(*map(Code, pair)) for pair in imports),
            tuple(map(Code, sorted(filter(None, self._exported)))),
            tuple(map(Code, sorted(self._rules))),
            tuple(self._functions.values()),
        )

    @property
    def files(self) -> Iterator[tuple[str, str]]:
        """The files of classes and rules, by their paths in the package's folder."""
        kept: dict[str, str] = {f"{TYPES}/__init__.py": '"""The classes of each version."""\n'}
        files = [RenderedFile(f"{TYPES}/{file.path}", file.text) for file in carried_runtime()]
        for side, (names, models) in self._reached.items():
            packages = sorted({name.package for name in names})
            parts = [models[package].only(names) for package in packages]
            files += home_files(side.home, parts, codecs=True)
        for plan in self._plans:
            files += [file for file in type_files(plan) if file.path != f"{TYPES}/_idlc.py"]
            if isinstance(plan.rules, Rules):
                kept[f"{_module(plan)}.py"] = plan.rules.source.text
        kept |= {file.path: file.text for file in files}
        return ((f"{FOLDER}/{path}", text) for path, text in kept.items())

    def _free(self, base: str, owner: object) -> str:
        """Return a name that means only this owner."""
        name, number = base, 1
        while self._names.setdefault(name, owner) != owner:
            number += 1
            name = f"{base}_{number}"
        return name

    def _class(self, side: _Side, name: ir.TypeName) -> str:
        """Return the expression of a class, and import it."""
        interface = interface_of(name)
        class_ = python_names.class_(interface)
        alias = self._free(f"{side.label}{class_}", (side, interface))
        module = f".{FOLDER}.{TYPES}.{side.home}.{name.package}.{name.kind}"
        self._imports.setdefault((module, f"{class_} as {alias}"))
        section = name.name[len(interface.name) + 1 :]
        return f"{alias}.{section}" if section else alias

    def _function(self, plan: Plan, old: _Side, new: _Side) -> str:
        """Return the name of the function of a plan; add it, and those that it calls."""
        key = plan.old.key, plan.new.key, old, new
        if key in self._functions:
            return self._functions[key].name
        classes = [
            self._class(side, version.name) for side, version in ((old, plan.old), (new, plan.new))
        ]
        words = snake_case(plan.new.name.name).replace("__", "_")
        name = self._free(f"{new.label}_{words}".lower(), key)
        if plan.through:
            lines = list(self._chain(plan, old, new))
        else:
            if plan.rules:
                self._plans.append(plan)
                self._rules.setdefault(_module(plan))
            lines = [
                Code(f"new = {classes[1]}()"),
                *self._lines(plan, old, new),
                Code("return new"),
            ]
        self._functions[key] = _FunctionView(
            Code(name), Code(classes[0]), Code(classes[1]), tuple(lines)
        )
        return name

    def _chain(self, plan: Plan, old: _Side, new: _Side) -> Iterator[Code | Text]:
        """Yield the lines that lead over versions in between."""
        value, side = "old", old
        for part in plan.through:
            key: Key = part.new.key
            following = _Side(key.short, key.short.lower())
            following = new if part is plan.through[-1] else following
            value, side = f"{self._function(part, side, following)}({value})", following
            if following is not new:
                self._plans.append(part)
        yield Code(f"return {value}")

    def _lines(self, plan: Plan, old: _Side, new: _Side) -> Iterator[Code | Text]:
        for field in plan.fields:
            name = python_names.field(field.new.name)
            reason = one_line(field.finding.reason)
            if field.finding.fate == "rule":
                yield Code(f"new.{name} = {self._ruled(plan, field, new)}")
            elif field.finding.fate == "needs a rule":
                yield Text(f"# TODO: {reason}")
                yield from [Code(f"# new.{name} = {field.finding.proposal}")] * bool(
                    field.finding.proposal
                )
                yield Code(f"raise NotImplementedError({name!r})")
            elif field.old is None or field.step is None:
                yield Text(f"# {reason}")
            else:
                value = f"old.{python_names.field(field.old.name)}"
                yield Code(f"new.{name} = {self._value(field.step, field.new, value, old, new)}")
        for finding in plan.dropped:
            yield Text(f"# {one_line(finding.reason)}")

    def _ruled(self, plan: Plan, field: FieldPlan, new: _Side) -> str:
        """Return the call of a rule; a message is copied to the class of this package."""
        call = f"{_module(plan)}.{python_names.field(field.new.name)}(old)"
        element = ir.element_of(field.new.type)
        if not isinstance(element, ir.Ref):
            return call
        class_ = self._class(new, element.target)
        if is_list(field.new.type):
            return f"[{class_}.from_dict(value.to_dict()) for value in {call}]"
        return f"{class_}.from_dict({call}.to_dict())"

    def _value(self, step: Step, field: ir.Field, value: str, old: _Side, new: _Side) -> str:
        """Return the expression of a new value from that of an old one."""
        is_many = is_list(field.type) and not step.wraps
        if step.element == "as is" and step.same and not step.wraps:
            return value
        element = self._element(step, field, "value" if is_many else value, old, new)
        if is_many:
            return f"[{element} for value in {value}]" if element != "value" else f"list({value})"
        return f"[{element}]" if step.wraps else element

    def _element(self, step: Step, field: ir.Field, value: str, old: _Side, new: _Side) -> str:
        type_ = ir.element_of(field.type)
        if step.nested is not None:
            return f"{self._function(step.nested, old, new)}({value})"
        if step.element == "number":
            return f"{value}[0]"
        if step.element == "byte":
            return f"bytes(({value},))"
        if not isinstance(type_, ir.Primitive) or type_.name in ("bool", "byte"):
            return value
        return f"{'float' if type_.info.low is None else 'int'}({value})"


def _module(plan: Plan) -> str:
    """Return the module of the rules of a plan, in the folder of versions."""
    old, new = plan.old.key.short, plan.new.key.short
    return f"{old}_to_{new.rpartition('_')[2]}".lower()
