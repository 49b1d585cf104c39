"""How long the parser of IDL would take, from the signs of a text: it tries every way to read an expression again.

Each constant, array length or annotation costs it about a millisecond, and each bracket within an expression fifty times as
much as what stands around it, so that three of them, one within the other, take minutes.
"""

from __future__ import annotations

import re

MAX_MILLISECONDS = 5_000
_EXPRESSION, _BRACKET, _SIGN, _DEEPER, _NESTED = 1.5, 150.0, 60.0, 50.0, 2.0

# What may hold any sign: texts, and comments; one without its end reaches to where it must end at the latest
_PASSED = re.compile(r'"(?:[^"\\]++|\\.)*+"?|\'(?:[^\'\\]++|\\.)*+\'?|//[^\n]*+|/\*.*?(?:\*/|\Z)', re.DOTALL)
_TOKEN = re.compile(r"@[\w:]++\s*+\(|sequence\s*+<|[()=\[;|^&+\-*/%<>~]")


def milliseconds(text: str) -> float:
    """Estimate the time that parsing takes [ms]; it grows with the text at most as it does.

    Parameters
    ----------
    text : str
        Definitions in IDL.
    """
    total, brackets, nested = 0.0, list[bool](), 0
    for found in _TOKEN.finditer(_PASSED.sub('""', text)):
        token, depth = found[0], sum(brackets)
        if token[0] == "@":
            brackets.append(False)
            total += _EXPRESSION
        elif token == "(":
            brackets.append(True)
            total += _BRACKET * _DEEPER**depth
        elif token == ")":
            if brackets:
                brackets.pop()
        elif token[0] == "s":
            nested += 1
            total += _EXPRESSION * _NESTED**nested
        elif token == ";":
            brackets.clear()
            nested = 0
        elif depth:
            total += _SIGN * _DEEPER ** (depth - 1)
        else:
            total += _EXPRESSION
        if total > MAX_MILLISECONDS:
            break
    return total
