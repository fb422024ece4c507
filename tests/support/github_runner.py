"""Steps of workflows and composite actions, carried out as GitHub's runner does.

Of the language of expressions it knows what the project uses; anything else is an error. Actions of
others are not here: a test says what they do.
"""

import os
import re
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import yaml

#: A word of an expression: a text, an operator, a function, or a name such as `inputs.paths`.
WORD = re.compile(r"\s*('(?:[^']|'')*'|\|\||&&|==|!=|[()]|always\(\)|[a-z]+(?:\.[\w-]+)+)")
OPERATORS = {"||": " or ", "&&": " and "}

Foreign = Callable[[Mapping[str, str]], Mapping[str, str]]


class Ended(NamedTuple):
    """How steps ended: whether none failed, what they printed, and what each gave to the others."""

    ok: bool
    printed: str
    outputs: dict[str, Mapping[str, str]]


def evaluate(expression: str, known: Mapping[str, str]) -> object:
    """Return the value of an expression; names that nobody knows are empty, as GitHub has it."""
    python, at = "", 0
    while at < len(expression.rstrip()):
        word = WORD.match(expression, at)
        assert word, f"not an expression that this runner knows: {expression}"
        text, at = word[1], word.end()
        if text.startswith("'"):
            python += repr(text[1:-1].replace("''", "'"))
        elif text == "always()":
            python += "True"
        elif re.match("[a-z]", text):
            python += repr(known.get(text, ""))
        else:
            python += OPERATORS.get(text, text)
    return eval(python, {"__builtins__": {}})  # noqa: S307 - of literals and operators alone


def filled(text: object, known: Mapping[str, str]) -> str:
    """Return a value of a step with its expressions replaced."""
    text = str(text).lower() if isinstance(text, bool) else str(text)
    return re.sub(r"\$\{\{(.*?)\}\}", lambda found: str(evaluate(found[1], known)), text)


class Runner:
    """A machine with a workspace; `foreign` are actions of others by name."""

    def __init__(
        self, workspace: Path, environment: Mapping[str, str], foreign: Mapping[str, Foreign]
    ) -> None:
        self.workspace = workspace
        self.environment = environment
        self.foreign = foreign

    def steps(self, steps: list[dict], known: Mapping[str, str], action: Path | None) -> Ended:
        """Carry out steps in order; after one that failed only those that always run."""
        done = Ended(True, "", {})
        for step in steps:
            condition = str(step.get("if", ""))
            names = {**known, **_flat(done.outputs)}
            inner = condition.removeprefix("${{").removesuffix("}}")
            wanted = bool(evaluate(inner, names)) if condition else True
            if not wanted or not (done.ok or "always()" in condition):
                continue
            ended = self._step(step, names, action)
            outputs = {**done.outputs, step.get("id", ""): ended.outputs.get("", {})}
            done = Ended(done.ok and ended.ok, done.printed + ended.printed, outputs)
        return done

    def _step(self, step: dict, known: Mapping[str, str], action: Path | None) -> Ended:
        given = {key: filled(value, known) for key, value in step.get("with", {}).items()}
        if "run" in step:
            return self._script(step, known, action)
        name, _, commit = step["uses"].partition("@")
        if name.startswith("./"):
            return self.action(self.workspace / name, given)
        assert re.fullmatch("[0-9a-f]{40}", commit), step["uses"]
        return Ended(True, "", {"": self.foreign[name](given)})

    def action(self, folder: Path, given: Mapping[str, str]) -> Ended:
        """Carry out a composite action with inputs."""
        declared = yaml.safe_load((folder / "action.yml").read_text(encoding="utf-8"))
        assert given.keys() <= declared["inputs"].keys()
        inputs = {name: one.get("default", "") for name, one in declared["inputs"].items()} | given
        known = {f"inputs.{name}": str(value) for name, value in inputs.items()}
        done = self.steps(declared["runs"]["steps"], known, folder)
        names = {**known, **_flat(done.outputs)}
        told = {name: filled(one["value"], names) for name, one in declared["outputs"].items()}
        return Ended(done.ok, done.printed, {"": told})

    def _script(self, step: dict, known: Mapping[str, str], action: Path | None) -> Ended:
        temporary = self.workspace.parent / "runner"
        temporary.mkdir(exist_ok=True)
        script, output = temporary / "step.sh", temporary / "output"
        script.write_text(filled(step["run"], known), encoding="utf-8")
        output.write_text("", encoding="utf-8")
        variables = {name: filled(value, known) for name, value in step.get("env", {}).items()}
        places = {"RUNNER_TEMP": temporary, "GITHUB_OUTPUT": output, "GITHUB_ACTION_PATH": action}
        done = subprocess.run(
            [step["shell"], "-e", str(script)],  # how GitHub calls sh and bash
            cwd=self.workspace,
            env={**self.environment, **variables, **{key: str(one) for key, one in places.items()}},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        lines = output.read_text(encoding="utf-8").splitlines()
        told = dict(line.split("=", 1) for line in lines)
        script.unlink()
        return Ended(done.returncode == 0, done.stdout, {"": told})


def _flat(outputs: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    return {
        f"steps.{step}.outputs.{name}": value
        for step, told in outputs.items()
        for name, value in told.items()
    }


def plain_environment() -> dict[str, str]:
    """Return this process's environment without what CI systems and idlc set."""
    left_out = ("GITHUB_", "IDLC_", "GIT_", "PYTHONPATH", "VIRTUAL_ENV")
    return {key: value for key, value in os.environ.items() if not key.startswith(left_out)}
