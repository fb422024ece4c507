"""The words and turns of phrase that must not return to what users read, each with a better one.

Add a pattern when a reader had to read a sentence twice. `problems` reads Markdown and plain text;
code blocks and code spans are not English, and a title may begin with `What`.
"""

import re

REPLACEMENTS = {
    r"verdicts?": "result, or: accepts and rejects the same files",
    r"blanks|(?:a|one) blank(?!\s+line)": "space, whitespace",
    r"la(?:ys?|id|ying)(?: \w+){0,2} out": "format",
    r"tidy|tidies": "format, normalize",
    r"tells|told|(?:to|can|cannot) tell": "report, show",
    r"says?|said|saying": "report, name, print; read the page as: covers, describes",
    r"spoil(?:s|ed|t)?": "corrupt",
    r"anew": "again",
    r"advised against|advises against": "discouraged",
    r"(?:is|are|that|which|changes?) meant": "intentional; stands for",
    r"what (?:is|was) (?:meant|wrong)": "the problem",
    r"(?<!there\s)(?:is|are|was|were|be) no(?! longer| more than| less than)(?= [a-z])": "is not a",
    r"(?:is|are|was|were) none of": "is not one of",
    r"is no more": "no longer exists, was removed",
    r"(?<!all )that of|those that|those who|the one that|the ones that": "repeat the noun",
    r"of whom|for whom|whoever|whomever": "anyone who, the reader, the user",
    r"so it is(?: with)?|so does it|it is so": "the same applies to",
    r"(?:is|are|be|been) (?:entered|put down)": "registered",
    r"(?:is|are) called so": "has that name",
    r"to be had": "available",
    r"(?:is|are) not looked at": "is not read",
    r"knows? (?:no|nothing|neither)": "has no, does not support",
    r"without harm|(?:do|does|did) no harm": "safe",
    r"answers? for it": "maintains it",
    r"another mind": "different",
    r"pastes? for": "snippet for",
    r"takes? the memory": "memory use is bounded by",
    r"however (?:long|large|many)": "regardless of, of any length",
    r"made of it|is made of|are made of": "consists of, depends on",
    r"with all that is": "including, expanded",
    r"by hand of": "written by",
    r"as it is there": "unchanged",
    r"is not for now|not planned now": "not planned",
    r"left alone": "kept, not changed",
    r"beside it,? or": "next to",
    r"nothing of (?:the|ROS|it|a)": "no part of",
    r"(?:looks?|looked) at nothing": "reads nothing",
    r"in one go": "at once",
    r"leads? on": "say what to do",
    r"has to be there": "must exist",
    r"who (?:runs?|asks?|wants?|writes?|reads?|needs?) \w+ (?:has|gets?|is)": "people who",
}
# At the start of a sentence, when it is not a question or a title.
HEADLESS = re.compile(r"(?:^|(?<=[.;:] ))(?:Who|What|Whether|That which) (?![^.?]*\?)[^.?]*[.;:]")
_CODE = re.compile(
    r"^( *)(```+|~~~+).*?^\1\2|^(?: {4}|\t)[^\n]*$|``[^\n]+?``|`[^`\n]+`|<!--.*?-->",
    re.MULTILINE | re.DOTALL,
)
_LINK = re.compile(r"\]\([^)]*\)")
_WORDS = {
    better: re.compile(rf"\b(?:{words})\b", re.IGNORECASE) for words, better in REPLACEMENTS.items()
}


def prose(text: str) -> str:
    """Return the text with code, comments and the targets of links cut out, in as many lines."""

    def emptied(match: re.Match[str]) -> str:
        return "`" + "\n" * match[0].count("\n")

    return _LINK.sub("]", _CODE.sub(emptied, text))


def problems(text: str) -> list[str]:
    """Return `line: words: better words`, in the order of the patterns."""
    text = prose(text)
    places = [
        (text.count("\n", 0, match.start()) + 1, match[0], better)
        for better, pattern in _WORDS.items()
        for match in pattern.finditer(text)
    ]
    start = 1
    for paragraph in re.split(r"\n(?=\s*(?:\n|[-*] |\d+\. |\|))", text):
        sentence = " ".join(paragraph.split()).lstrip("*- ")
        if not sentence.startswith(("#", "|")):
            places += [
                (start, match[0][:60], "begin with an actor or a noun")
                for match in HEADLESS.finditer(sentence)
            ]
        start += paragraph.count("\n") + 1
    return [f"{line}: {words}: {better}" for line, words, better in places]
