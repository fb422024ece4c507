"""A bag: a folder with the files of one recording, and mostly a metadata.yaml that names them."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from idlc.project.words import COMPRESSED, METADATA, SUFFIXES, ZSTD, natural
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.damage import Damage

#: Keys in the metadata.
INFORMATION, TOPICS = "rosbag2_bagfile_information", "topics_with_message_count"
TOPIC, COUNT, PATHS = "topic_metadata", "message_count", "relative_file_paths"
START, DURATION = "starting_time", "duration"
TYPE_KEYS = ("type", "type_description_hash")
#: No recorder writes more, or deeper.
MOST_OF_METADATA = 1 << 23
DEEPEST = 100


class BagFiles(NamedTuple):
    """The files of a bag in their order, notes about them, and those that are missing.

    `counted` is the number of messages that the metadata counts.
    """

    paths: list[Path]
    notes: list[str]
    missing: list[Damage]
    counted: int


def files_of(folder: Path) -> BagFiles:
    """Return the files of a bag."""
    try:
        every = (file for file in folder.iterdir() if file.is_file())
        files = sorted(every, key=lambda file: natural(file.name))
    except OSError as error:
        raise RecordingError(f"`{folder}` cannot be read: {error.strerror}") from None
    present = {file.name: file for file in files if file.name.endswith(SUFFIXES + COMPRESSED)}
    named, notes, counted = _listing(folder / METADATA, present)
    missing = [name for name in named if name not in present]
    reason = f"is missing, although {METADATA} lists it"
    damage = [Damage(str(folder / name), f"`{name}` {reason}") for name in missing]
    if len(missing) < len(named):
        others = (name for name in present if name not in named and name + ZSTD not in named)
        notes += [f"idlc skips `{name}`: {METADATA} does not list it" for name in others]
        present = {name: present[name] for name in named if name in present}
    if not present:
        raise _no_recording(folder)
    # a file may be there twice after it was decompressed
    plain = {file.name: file for file in files if file.name.endswith(SUFFIXES)}
    chosen = [plain.get(name.removesuffix(ZSTD), file) for name, file in present.items()]
    return BagFiles(list(dict.fromkeys(chosen)), notes, damage, counted)


def _no_recording(folder: Path) -> RecordingError:
    inside = min((path.parent for path in folder.glob(f"*/{METADATA}")), default=None)
    hint = f"pass a bag in it, such as `{inside}`" if inside else "it has no .mcap or .db3 file"
    return RecordingError(f"`{folder}` contains no recording", hint)


def _listing(metadata: Path, present: Container[str]) -> tuple[list[str], list[str], int]:
    """Return the files that a metadata.yaml lists, notes, and the number of messages.

    The files are those of the bag's folder, of which some are `present`.
    """
    if not metadata.is_file():
        return [], [], 0
    try:
        paths, counted = _contents(metadata)
    except RecordingError as error:
        return [], [f"{error.message}; idlc reads all files in the folder"], 0
    names = (path if path in present else _own_name(path) for path in paths)
    return list(dict.fromkeys(names)), [], counted


def retyped(metadata: Path, new_type: Callable[[str, str], tuple[str, str] | None]) -> bytes | None:
    """Return a metadata.yaml with the new types and type hashes of topics.

    `new_type` gets the name and type of each topic. The rest stays as it is. Returns None if idlc
    cannot read the file.
    """
    try:
        data = _read(metadata)
        root = _root(data)
    except RecordingError:
        return None
    edits: list[_Edit] = []
    expected = []
    for topic in _topics(root):
        own = _type_of(topic)
        changed = new_type(own.get("name", ""), own.get("type", ""))
        new = dict(zip(TYPE_KEYS, changed, strict=True)) if changed else {}
        expected.append({key: new.get(key, value) for key, value in own.items()})
        for key in new.keys() & own.keys():
            (old, *_) = _values([topic], key)
            edits.append((old.start_mark.index, old.end_mark.index, new[key] or '""'))
    text = _edited(data.decode(), edits)
    try:  # an alias may be lost, or change the type of another topic, too
        is_done = list(map(_type_of, _topics(_root(text.encode())))) == expected
    except RecordingError:
        is_done = False
    if not is_done:
        raise RecordingError(f"the types in `{metadata}` cannot be changed")
    return text.encode()


class FileExtent(NamedTuple):
    """The number of messages in a file of a bag, and the times of the first and the last one."""

    messages: int
    span: tuple[int, int] | None

    def times(self) -> dict[str, tuple[str, int]]:
        """Return the key of each time and its value in nanoseconds, by the key around it."""
        start, end = self.span or (0, 0)
        return {START: ("nanoseconds_since_epoch", start), DURATION: ("nanoseconds", end - start)}


def listed_topics(metadata: Path) -> list[tuple[str, str]]:
    """Return the name and the type of each topic that a metadata.yaml lists."""
    nodes = (_values([topic], TOPIC)[:1] for topic in _listed_topics(_root(_read(metadata))))
    topics = (_type_of(*node) if node else {} for node in nodes)
    return [(topic.get("name", ""), topic.get("type", "")) for topic in topics]


def recounted(metadata: bytes, counts: Sequence[int], files: Mapping[str, FileExtent]) -> bytes:
    """Return a metadata.yaml with the messages of each listed topic and of files, and the times.

    Other files are left out. `metadata` is what `retyped` returns.
    """
    total = _total(files.values())
    root = _root(metadata)
    information = _values([root], INFORMATION)
    values = [(information, COUNT, total.messages)]
    for outer, (key, time) in total.times().items():
        values.append((_values(information, outer), key, time))
    edits = [_number(node, value) for nodes, key, value in values for node in _values(nodes, key)]
    for topic, count in zip(_listed_topics(root), counts, strict=True):
        edits += [_number(node, count) for node in _values([topic], COUNT)]
    for paths in _values(information, PATHS):
        names = [str(node.value) for node in paths.value if node.id == "scalar"]
        edits.append(_listed(paths, [name for name in names if _plain_name(name) in files]))
    for described in _values(information, "files"):
        contents = (_content(node) for node in described.value if node.id == "mapping")
        edits.append(_listed(described, list(_described(contents, files))))
    return _edited(metadata.decode(), edits).encode()


def _total(files: Iterable[FileExtent]) -> FileExtent:
    """Return the extent of a bag of some files."""
    messages, spans = 0, list[tuple[int, int]]()
    for file in files:
        messages += file.messages
        spans += [file.span] if file.span else []
    if not spans:
        return FileExtent(messages, None)
    return FileExtent(messages, (min(spans)[0], max(end for _, end in spans)))


def _described(
    contents: Iterable[dict[str, Any]], files: Mapping[str, FileExtent]
) -> Iterator[dict[str, Any]]:
    """Yield what a metadata.yaml says about files, of those that there are."""
    for content in contents:
        extent = files.get(_plain_name(str(content.get("path", ""))))
        if extent is not None:
            times = {outer: {key: time} for outer, (key, time) in extent.times().items()}
            yield {**content, **times, COUNT: extent.messages}


#: A part of a text, from one offset to another, and what takes its place.
_Edit: TypeAlias = tuple[int, int, str]


def _edited(text: str, edits: Iterable[_Edit]) -> str:
    at, parts = 0, list[str]()
    for start, end, value in sorted(edits):
        # the lines after a block belong to what follows
        blanks = text[start:end][len(text[start:end].rstrip()) :]
        parts += text[at:start], " " * (text[start - 1] != " "), value, blanks
        at = end
    return "".join((*parts, text[at:]))


def _number(node: Any, number: int) -> _Edit:
    return node.start_mark.index, node.end_mark.index, str(number)


def _listed(node: Any, items: list[Any]) -> _Edit:
    """Return the edit that writes a list on one line, further right than its key."""
    return node.start_mark.index, node.end_mark.index, f"  {json.dumps(items)}"


def _content(node: Any) -> Any:
    """Return the content of a node of numbers and texts."""
    if node.id == "mapping":
        return {str(key.value): _content(value) for key, value in node.value}
    if node.id == "sequence":
        return list(map(_content, node.value))
    is_number = node.style is None and re.fullmatch(r"-?\d{1,20}", node.value, re.ASCII)
    return int(node.value) if is_number else node.value


def _plain_name(path: str) -> str:
    """Return the name of a file that may be compressed as a whole."""
    return _own_name(path).removesuffix(ZSTD)


def _type_of(topic: Any) -> dict[str, str]:
    """Return the name of a topic, and what there is of its type."""
    keys = ("name", *TYPE_KEYS)
    values = {key: value for key in keys for value in _values([topic], key)[:1]}
    return {key: value.value for key, value in values.items() if value.id == "scalar"}


def _listed_topics(root: Any) -> list[Any]:
    """Return the nodes of topics."""
    lists = _values(_values([root], INFORMATION), TOPICS)
    return [topic for own in lists if own.id == "sequence" for topic in own.value]


def _topics(root: Any) -> list[Any]:
    """Return the nodes that describe topics."""
    return _values(_listed_topics(root), TOPIC)


def _contents(metadata: Path) -> tuple[list[str], int]:
    """Return the names in `relative_file_paths`, and the number of messages.

    Raises RecordingError if they cannot be read.
    """
    information = _values([_root(_read(metadata))], INFORMATION)
    counts = [str(node.value) for node in _values(information, COUNT)]
    is_number = bool(counts) and re.fullmatch(r"\d{1,18}", counts[0], re.ASCII)
    paths = _values(information, PATHS)
    lists = (path_list.value for path_list in paths if path_list.id == "sequence")
    names = [str(node.value) for node in chain.from_iterable(lists) if node.id == "scalar"]
    return names, int(counts[0]) if is_number else 0


def _read(metadata: Path) -> bytes:
    """Return the bytes of a metadata.yaml, or too many."""
    try:
        with metadata.open("rb") as file:
            return file.read(MOST_OF_METADATA + 1)
    except OSError as error:
        raise RecordingError(f"`{METADATA}` cannot be read: {error.strerror}") from None


def _root(text: bytes) -> Any:
    """Return the node of a metadata.yaml; raise RecordingError if it is none."""
    import yaml

    if len(text) > MOST_OF_METADATA:
        raise RecordingError(f"`{METADATA}` is larger than {MOST_OF_METADATA >> 20} MiB")
    # only the nodes of the file are needed: no objects are constructed, and nothing is merged
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        depth = 0
        for event in yaml.parse(text, loader):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > DEEPEST:
                raise RecordingError(f"`{METADATA}` nests more than {DEEPEST} levels deep")
        return yaml.compose(text, loader)
    except (yaml.YAMLError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
        raise RecordingError(f"`{METADATA}{where}` is not YAML") from None


def _values(nodes: Iterable[Any], key: str) -> list[Any]:
    """Return the nodes at a key of mappings, each node once; a mapping may have it twice."""
    mappings = {id(node): node for node in nodes if getattr(node, "id", "") == "mapping"}
    pairs = (pair for node in mappings.values() for pair in node.value)
    return list({id(value): value for name, value in pairs if name.value == key}.values())


def _own_name(path: str) -> str:
    """Return a file's name in the bag: older versions put the bag's own folder in front."""
    return path.replace("\\", "/").rpartition("/")[2]
