"""The part of protobuf's text format that Lightwell's body files use. Standard library alone."""

import re


def parse(text: str) -> dict[str, list]:
    """Name -> list of numbers, strings and messages (dicts). ValueError for a number that is none."""
    tokens = re.findall(r'"[^"]*"|[{}\[\]:,;<>]|[^\s{}\[\]:,;<>"]+', re.sub(r"#[^\n]*", "", text))
    position = 0

    def scalar(token: str):
        return token[1:-1] if token.startswith('"') else float(token)

    def message() -> dict[str, list]:
        nonlocal position
        out: dict[str, list] = {}
        while position < len(tokens) and tokens[position] != "}":
            values = out.setdefault(tokens[position], [])
            position += 1
            if tokens[position] == ":":
                position += 1
            if tokens[position] == "{":
                position += 1
                values.append(message())
                position += 1
            elif tokens[position] == "[":
                end = tokens.index("]", position)
                values.extend(scalar(t) for t in tokens[position + 1:end] if t != ",")
                position = end + 1
            else:
                values.append(scalar(tokens[position]))
                position += 1
            if position < len(tokens) and tokens[position] in ",;":
                position += 1
        return out

    return message()
