"""The kinds of tokens that are told apart, by their places in these lists."""

TYPES = ["type", "struct", "property", "enumMember", "number", "string", "comment", "operator"]
TYPES += ["keyword", "namespace"]
MODIFIERS = ["declaration", "readonly", "defaultLibrary"]
