"""Names of the C that linkers see: with the prefix of an FMU's functions, if it has one.

A program that links several FMUs into itself defines FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX
for each, and so none of their names meet. In a shared library only FMI's own are visible.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

HEADER = "kr16_names.h"
_OWN = re.compile(r"\bkr16_[a-z0-9_]+\b(?!\.[ch])")

_HEAD = """/* Written by kr16cli: names begin with the prefix of the FMU, if it has one. */
#if defined FMI2_FUNCTION_PREFIX && !defined FMI3_FUNCTION_PREFIX
#define FMI3_FUNCTION_PREFIX FMI2_FUNCTION_PREFIX
#elif defined FMI3_FUNCTION_PREFIX && !defined FMI2_FUNCTION_PREFIX
#define FMI2_FUNCTION_PREFIX FMI3_FUNCTION_PREFIX
#endif
#ifdef FMI2_FUNCTION_PREFIX
#define KR16_GLUED(prefix, name) prefix##name
#define KR16_JOINED(prefix, name) KR16_GLUED(prefix, name)
#define KR16_OWN(name) KR16_JOINED(FMI2_FUNCTION_PREFIX, name)
"""


def prefixed(files: Mapping[str, str]) -> dict[str, str]:
    """The files with a header that gives names their prefix, taken in first by each C file."""
    found = sorted({name for text in files.values() for name in _OWN.findall(text)})
    lines = [f"#define {name} KR16_OWN({name})" for name in found]
    first = f'#include "{HEADER}"\n'
    return {
        **{name: first + text if name.endswith(".c") else text for name, text in files.items()},
        HEADER: "\n".join([_HEAD + "\n".join(lines), "#endif", ""]),
    }
