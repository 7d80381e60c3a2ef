#!/usr/bin/python3
"""No two headers that end up in one program define a type of the same name: the linker would take one of them
for both. Usage: one_definition_test.py SOURCE_DIR. Prints each such name and exits 1 if there is one."""

import collections
import pathlib
import re
import sys

# What `atlas` is made of, and what `atlasd` is: types of the one may have names of the other.
PROGRAMS = {
    "atlas": ["core", "proto/wire", "client", "server/base", "server/store"],
    "atlasd": ["core", "proto/wire", "server"],
}
DEFINITION = re.compile(r"^(?:class|struct|enum class|union)\s+(?:\[\[\w+\]\]\s+)?(\w+)\b[^;{()]*\{", re.M)


def headers_by_type(root, folders):
    found = collections.defaultdict(set)
    for folder in folders:
        for path in sorted((root / folder).rglob("*.h")):
            for name in DEFINITION.findall(path.read_text(encoding="utf-8")):
                found[name].add(path.relative_to(root).as_posix())
    return found


def main():
    root = pathlib.Path(sys.argv[1])
    failed = False
    for program, folders in PROGRAMS.items():
        types = headers_by_type(root, folders)
        doubles = {name: headers for name, headers in types.items() if len(headers) > 1}
        for name, headers in doubles.items():
            print(f"{program}: {name} is defined in {', '.join(sorted(headers))}")
        print(f"{program}: {len(types)} types, {len(doubles)} defined twice")
        failed |= not types or bool(doubles)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
