"""The real rosidl as a process: rosidl_side.py CASES OUTCOMES, two JSON-lines files.

A case has `kind`, `pkg`, `name`, `bytes_hex` (the file's bytes) and `siblings` (path to text). An
outcome has `stage` (where rosidl gave up: adapter, parser, type_description or generator_py; null
if it did not), `parsed` (the structures as its parser sees them) and `hash`, as in golden/spec,
and as `idl` the .idl file that the adapter wrote.
"""

import json
import multiprocessing
import sys
import tempfile
from pathlib import Path

from rosidl_adapter import convert_to_idl
from rosidl_generator_py import generate_py
from rosidl_generator_type_description import generate_type_hash
from rosidl_parser import definition as idl
from rosidl_parser.parser import get_ast_from_idl_string, parse_idl_file

SHARE = Path(sys.prefix) / "share"
PACKAGES = [f"{path.parent.name}:{path.parent}" for path in SHARE.glob("*/msg")]


def type_text(type_):
    """Return the IDL spelling of a type."""
    if isinstance(type_, idl.Array):
        return f"{type_text(type_.value_type)}[{type_.size}]"
    if isinstance(type_, idl.AbstractSequence):
        bound = f", {type_.maximum_size}" if type_.has_maximum_size() else ""
        return f"sequence<{type_text(type_.value_type)}{bound}>"
    if isinstance(type_, idl.AbstractGenericString):
        word = "string" if isinstance(type_, idl.AbstractString) else "wstring"
        return f"{word}<{type_.maximum_size}>" if type_.has_maximum_size() else word
    if isinstance(type_, idl.NamespacedType):
        return "/".join(type_.namespaced_name())
    return type_.typename


def member_record(member):
    record = {
        "name": member.name,
        "type": type_text(member.type),
        "comment": member.get_comment_lines(),
    }
    for key in ("default", "unit"):
        if member.has_annotation(key):
            record[key] = member.get_annotation_value(key)["value"]
    return record


def structure_record(message):
    return {
        "name": message.structure.namespaced_type.name,
        "comment": message.structure.get_comment_lines(),
        "members": [member_record(member) for member in message.structure.members],
        "constants": [
            {
                "name": constant.name,
                "type": type_text(constant.type),
                "value": constant.value,
                "comment": constant.get_comment_lines(),
            }
            for constant in message.constants
        ],
    }


def structures(content):
    for element in content.elements:
        if isinstance(element, idl.Message):
            yield element
        elif isinstance(element, idl.Service):
            yield from (element.request_message, element.response_message)
        elif isinstance(element, idl.Action):
            yield from (element.goal, element.result, element.feedback)


class Pipeline:
    """rosidl's stages over one file and its siblings, in a folder of their own."""

    def __init__(self, case, folder):
        self.case = case
        self.sources = folder / "sources"
        self.idl = folder / "idl"
        self.out = folder / "out"
        own = f"{case['kind']}/{case['name']}.{case['kind']}"
        self.files = [own, *case.get("siblings", {})]
        texts = {path: text.encode() for path, text in case.get("siblings", {}).items()}
        for path, data in {**texts, own: bytes.fromhex(case["bytes_hex"])}.items():
            (self.sources / path).parent.mkdir(parents=True, exist_ok=True)
            (self.sources / path).write_bytes(data)

    def adapter(self):
        for path in self.files:
            convert_to_idl(self.sources, self.case["pkg"], Path(path), self.idl)

    def idl_text(self):
        return (self.idl / self.files[0]).with_suffix(".idl").read_bytes().decode(errors="replace")

    def parser(self):
        path = Path(self.files[0]).with_suffix(".idl")
        content = parse_idl_file(idl.IdlLocator(self.idl, path)).content
        return [structure_record(message) for message in structures(content)]

    def arguments(self):
        written = [Path(path).with_suffix(".idl") for path in self.files]
        arguments = {
            "package_name": self.case["pkg"],
            "output_dir": str(self.out),
            "idl_tuples": [f"{self.idl}:{path}" for path in written],
            "include_paths": PACKAGES,
            "template_dir": str(SHARE / "rosidl_generator_py" / "resource"),
            "target_dependencies": [],
        }
        path = self.out.parent / "arguments.json"
        path.write_text(json.dumps(arguments), encoding="utf-8")
        return str(path)

    def type_description(self):
        generate_type_hash(self.arguments())
        path = self.out / Path(self.files[0]).with_suffix(".json")
        hashes = json.loads(path.read_text(encoding="utf-8"))["type_hashes"]
        return hashes[0]["hash_string"]

    def generator_py(self):
        arguments = json.loads(Path(self.arguments()).read_text(encoding="utf-8"))
        arguments["target_dependencies"] = [__file__]
        arguments["idl_tuples"] = arguments["idl_tuples"][:1]  # the siblings are known to be sound
        path = self.out.parent / "arguments.json"
        path.write_text(json.dumps(arguments), encoding="utf-8")
        generate_py(str(path), [])


def outcome_of(case):
    outcome = {"stage": None, "parsed": None, "hash": None}
    with tempfile.TemporaryDirectory() as folder:
        pipeline = Pipeline(case, Path(folder))
        for stage in ("adapter", "parser", "type_description", "generator_py"):
            key = {"parser": "parsed", "type_description": "hash"}.get(stage, "")
            try:
                outcome[key] = getattr(pipeline, stage)()
            except (Exception, SystemExit) as error:
                outcome |= {"stage": stage, "error": type(error).__name__}
                break
            if stage == "adapter":
                outcome["idl"] = pipeline.idl_text()
    outcome.pop("", None)
    return outcome


def main():
    cases, outcomes = map(Path, sys.argv[1:])
    lines = cases.read_text(encoding="utf-8").splitlines()
    # rosidl's parser makes its tables when it is first used: here, not in each process
    get_ast_from_idl_string("module a { struct B { octet c; }; };")
    # a process each, forked from this one with everything imported: rosidl leaves traces of a
    # file that failed in empy, which the next file would trip over
    with multiprocessing.get_context("fork").Pool(2, maxtasksperchild=1) as pool:
        found = pool.map(outcome_of, map(json.loads, lines), chunksize=1)
    text = "".join(json.dumps(outcome) + "\n" for outcome in found)
    outcomes.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
