#!/usr/bin/env python3
"""Generates the tables of messages and enums in proto/README.md from the comments of the .proto files.

usage: wire_tables.py [--root DIR]            fail if a table in proto/README.md differs from the .proto file
       wire_tables.py [--root DIR] --write    generate the tables again and write them
       wire_tables.py --self-test             check the checker
A table is between `<!-- fields of FILE -->` and `<!-- end of fields -->`; FILE is relative to proto/. A field without
a comment is an error: proto/README.md is the specification of the wire format.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from google.protobuf import descriptor_pb2

HERE = Path(__file__).resolve().parent
BLOCK = re.compile(r"<!-- fields of (\S+) -->\n.*?<!-- end of fields -->\n", re.S)
FIELD = descriptor_pb2.FieldDescriptorProto


def parsed(root, name):
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "set"
        subprocess.run(["protoc", f"-I{root}", "--include_source_info", f"--descriptor_set_out={out}", name],
                       check=True)
        files = descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes()).file
    return files[0]


def comments_of(file):
    return {tuple(where.path): " ".join(where.leading_comments.split()) for where in file.source_code_info.location}


def type_name(field, messages):
    if field.type in (FIELD.TYPE_MESSAGE, FIELD.TYPE_ENUM):
        name = field.type_name.removeprefix(".lightwell.v1.")
        name = f"[{name}](#{anchor(name)})" if name in messages else name
    else:
        name = FIELD.Type.Name(field.type).removeprefix("TYPE_").lower()
    repeated = field.label == FIELD.LABEL_REPEATED
    return ("repeated " if repeated else "optional " if field.proto3_optional else "") + name


def anchor(name):
    return name.lower().replace(".", "")


def cell(text):
    return text.replace("|", "\\|")


def message_table(message, path, name, comments, messages):
    yield from heading(name, comments.get(path))
    if message.field:
        yield "| field | number | type | meaning |\n| --- | --- | --- | --- |\n"
    for index, field in enumerate(message.field):
        comment = comments.get(path + (2, index))
        if not comment:
            raise ValueError(f"{name}.{field.name} has no comment")
        if field.HasField("oneof_index") and not field.proto3_optional:
            comment = f"One of `{message.oneof_decl[field.oneof_index].name}`. {comment}"
        yield f"| `{field.name}` | {field.number} | {type_name(field, messages)} | {cell(comment)} |\n"
    yield "\n"
    for index, inner in enumerate(message.enum_type):
        yield from enum_table(inner, path + (4, index), f"{name}.{inner.name}", comments)
    for index, inner in enumerate(message.nested_type):
        yield from message_table(inner, path + (3, index), f"{name}.{inner.name}", comments, messages)


def enum_table(enum, path, name, comments):
    yield from heading(name, comments.get(path))
    yield "| value | number | meaning |\n| --- | --- | --- |\n"
    for index, value in enumerate(enum.value):
        comment = comments.get(path + (2, index), "")
        if not comment and not value.name.endswith("UNSPECIFIED"):
            raise ValueError(f"{name}.{value.name} has no comment")
        yield f"| `{value.name}` | {value.number} | {cell(comment)} |\n"
    yield "\n"


def heading(name, comment):
    yield f"#### {name}\n"
    yield f"{comment}\n\n" if comment else "\n"


def names_in(messages, prefix=""):
    for message in messages:
        yield prefix + message.name
        for enum in message.enum_type:
            yield f"{prefix}{message.name}.{enum.name}"
        yield from names_in(message.nested_type, f"{prefix}{message.name}.")


def message_and_enum_names(file):
    return set(names_in(file.message_type)) | {enum.name for enum in file.enum_type}


def tables(file, known):
    """The tables of a file; `known`: names that have a table, to which the column of types links."""
    comments = comments_of(file)
    text = ""
    for index, message in enumerate(file.message_type):
        text += "".join(message_table(message, (4, index), message.name, comments, known))
    for index, enum in enumerate(file.enum_type):
        text += "".join(enum_table(enum, (5, index), enum.name, comments))
    return text


def with_new_tables(root, text):
    """The README's text with every table generated again."""
    files = {name: parsed(root, name) for name in BLOCK.findall(text)}
    known = set().union(*map(message_and_enum_names, files.values()))
    return BLOCK.sub(
        lambda m: f"<!-- fields of {m[1]} -->\n\n{tables(files[m[1]], known)}<!-- end of fields -->\n", text)


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        proto = root / "a.proto"
        head = 'syntax = "proto3"; package lightwell.v1;\n'
        proto.write_text(head + "// A thing.\nmessage Thing {\n  // Metres | feet.\n  uint32 size = 7;\n}\n")
        readme = "before\n<!-- fields of a.proto -->\n<!-- end of fields -->\nbehind\n"
        once = with_new_tables(root, readme)
        row = "| `size` | 7 | uint32 | Metres \\| feet. |"
        if row not in once or with_new_tables(root, once) != once or not once.endswith("behind\n"):
            sys.exit(f"self-test: the table is wrong:\n{once}")
        proto.write_text(proto.read_text().replace("Metres", "Inches"))
        if with_new_tables(root, once) == once:
            sys.exit("self-test: a changed comment was not noticed")
        (root / "b.proto").write_text(head + 'import "a.proto";\nmessage Other {\n  // One.\n  Thing thing = 1;\n}\n')
        both = with_new_tables(root, once + "<!-- fields of b.proto -->\n<!-- end of fields -->\n")
        if "| `thing` | 1 | [Thing](#thing) | One. |" not in both:
            sys.exit(f"self-test: no link to a table of another file:\n{both}")
        proto.write_text(head + "message Thing { uint32 size = 7; }\n")
        try:
            with_new_tables(root, once)
        except ValueError as error:
            if "Thing.size has no comment" not in str(error):
                sys.exit(f"self-test: {error}")
        else:
            sys.exit("self-test: a field without a comment was not noticed")
    print("self-test: good")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path, default=HERE.parents[1])
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    readme = arguments.root / "proto/README.md"
    text = readme.read_text()
    if not BLOCK.search(text):
        sys.exit(f"{readme}: there is no `<!-- fields of FILE -->` ... `<!-- end of fields -->`")
    try:
        generated = with_new_tables(arguments.root / "proto", text)
    except ValueError as error:
        sys.exit(f"{arguments.root / 'proto'}: {error}; add a comment above it in the .proto file")
    if arguments.write:
        readme.write_text(generated)
    elif generated != text:
        old = text.splitlines()
        lines = generated.splitlines() + [""]
        differs = next(n for n, line in enumerate(lines, 1) if n > len(old) or old[n - 1] != line)
        sys.exit(f"{readme}:{differs}: differs from the .proto files; run {Path(__file__).name} --write")


if __name__ == "__main__":
    sys.exit(main())
