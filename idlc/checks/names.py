"""Names that ROS 2 refuses: packages, interfaces, and the same name twice (language 2.2)."""

from __future__ import annotations

from idlc.checks.sections import sections
from idlc.diagnostics import codes
from idlc.diagnostics.report import Label, Report
from idlc.model import derive, ir, names
from idlc.model.link import Model


def package_name(model: Model, report: Report) -> None:
    """The package's name is valid; the problem is the package's, so it is reported once."""
    if not names.is_package_name(model.package):
        where = model.own[0].source if model.own else None
        report.add(
            codes.INVALID_PACKAGE_NAME.of(
                where.path if where else model.package,
                f"`{model.package}` cannot be a package name",
                hint=names.PACKAGE_HINT,
            )
        )


def interface_names(model: Model, report: Report) -> None:
    """File names, and the names derived from them for services and actions, are valid."""
    for interface in model.own:
        if all(names.is_message_name(part.name.name) for part in derive.sections(interface)):
            continue
        name, kind = interface.name.name, interface.name.kind
        like = names.message_name_like(name)
        if kind != "msg" and names.is_message_name(name):
            hint = "this ending is kept for the parts of services and actions"
        else:
            hint = f"call it `{like}.{kind}`" if names.is_message_name(like) else names.MESSAGE_HINT
        report.add(
            codes.INVALID_INTERFACE_NAME.of(
                interface.source.path if interface.source else str(interface.name),
                f"`{name}` cannot be the name of a .{kind} file",
                hint=hint,
            )
        )


def unique_fields(model: Model, report: Report) -> None:
    """No structure has two fields of one name."""
    for message in sections(model):
        first: dict[str, ir.Field] = {}
        for field in message.fields:
            earlier = first.setdefault(field.name, field)
            if earlier is not field and field.name_span and earlier.name_span:
                report.add(
                    codes.DUPLICATE_FIELD.at(
                        field.name_span,
                        f"a second field `{field.name}`",
                        labels=(Label(earlier.name_span, "the first is here"),),
                        hint="rename or remove one of them",
                    )
                )


def unique_constants(model: Model, report: Report) -> None:
    """No structure has two constants of one name."""
    for message in sections(model):
        first: dict[str, ir.Constant] = {}
        for constant in message.constants:
            earlier = first.setdefault(constant.name, constant)
            if earlier is not constant and constant.name_span and earlier.name_span:
                report.add(
                    codes.DUPLICATE_CONSTANT.at(
                        constant.name_span,
                        f"a second constant `{constant.name}`",
                        labels=(Label(earlier.name_span, "the first is here"),),
                        hint="rename or remove one of them",
                    )
                )


def unique_modules(model: Model, report: Report) -> None:
    """Two interfaces of one kind do not share rosidl's Python module."""
    first: dict[tuple[str, str], ir.TypeName] = {}
    for interface in model.own:
        name = interface.name
        earlier = first.setdefault((name.kind, names.snake_case(name.name)), name)
        if earlier is not name and interface.source:
            report.add(
                codes.SAME_PYTHON_MODULE.of(
                    interface.source.path,
                    f"rosidl puts `{name.name}` and `{earlier.name}` into one Python module, "
                    f"`_{names.snake_case(name.name)}`, where one of them is lost",
                    hint="give them names that differ in more than capitals",
                )
            )
