"""The size of idlc: modules and lines of code of each room.

`python -m benchmarks.size` prints them. Blank lines, comments and docstrings are no code.
"""

import ast
import sys
import tokenize
from collections import Counter
from pathlib import Path

PACKAGE = Path(__file__).parent.parent / "idlc"
NO_CODE = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
NO_CODE |= {tokenize.ENCODING, tokenize.ENDMARKER}


def code_lines(path: Path) -> int:
    """Return the number of lines that hold code."""
    with tokenize.open(path) as file:
        tokens = [*tokenize.generate_tokens(file.readline)]
    lines = {
        line
        for token in tokens
        if token.type not in NO_CODE
        for line in range(token.start[0], token.end[0] + 1)
    }
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            lines.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(lines)


modules, lines = Counter[str](), Counter[str]()
for module in PACKAGE.rglob("*.py"):
    room = module.relative_to(PACKAGE).parts[0] if module.parent != PACKAGE else "idlc"
    modules[room] += 1
    lines[room] += code_lines(module)
for room in sorted(modules):
    sys.stdout.write(f"{room:12} {modules[room]:4} modules {lines[room]:6} lines\n")
sys.stdout.write(f"{'all':12} {modules.total():4} modules {lines.total():6} lines\n")
