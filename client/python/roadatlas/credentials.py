"""The token of a person (docs/daemon.md, Who may come in)."""

import os
import pathlib

from roadatlas.errors import BadCredentials


def read_token(file: str | os.PathLike[str]) -> str:
    """The first line of the file. BadCredentials if there is none."""
    try:
        lines = pathlib.Path(file).read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BadCredentials(f"there is no token in {file}: {error}") from error
    if not lines or not lines[0]:
        raise BadCredentials(f"there is no token in {file}")
    return lines[0]
