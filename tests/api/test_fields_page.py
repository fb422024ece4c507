"""The programs of docs/fields.md."""

import re

from idlc.cli.main import main
from tests.support import recordings as made
from tests.support.paths import DOCS

PAGE = (DOCS / "fields.md").read_text(encoding="utf-8")


def test_programs_do_what_the_page_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    made.by_mcap(tmp_path / "drive.mcap", made.messages(300))
    program = "\n".join(re.findall(r"^```python\n((?:.*\n)*?)```$", PAGE, re.MULTILINE))
    exec(program, {})  # noqa: S102 - a page of ours
    assert re.search(
        r"^\d+ of 100\n\d+ match, \d+ have no position$", capsys.readouterr().out, re.MULTILINE
    )
    assert main(["columns", "drive.mcap", "/imu", "--where", "linear_acceleration.z > 0.5",
                 "-o", "fast.parquet"]) == 0  # fmt: skip
