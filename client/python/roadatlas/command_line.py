"""Flags of `python3 -m roadatlas`, and the connection that they and the environment describe (docs/python.md)."""

import argparse
import math
import os
import pathlib
import sys
from collections.abc import Callable
from typing import NoReturn

from roadatlas.client import AtlasClient
from roadatlas.credentials import read_token
from roadatlas.errors import BadCredentials
from roadatlas.tls import Tls

DEFAULT_SERVER = "127.0.0.1:7447"
_SECURITY = (("ca", "FILE", "speak TLS; who vouches for the daemon, PEM"), ("certificate", "FILE", "ours, PEM"),
             ("key", "FILE", "of our certificate, PEM"),
             ("name", "NAME", "the daemon's name in its certificate [the host]"))

_TRUE = ("true", "1", "yes", "on")
_FALSE = ("", "false", "0", "no", "off")
_MAX_U32, _MAX_U64 = (1 << 32) - 1, (1 << 64) - 1
_MAX_PLACE_M, _MAX_LENGTH_M = 1e7, 1e8  # what the daemon takes


class _Parser(argparse.ArgumentParser):

    def error(self, message: str) -> NoReturn:
        """In one line, without the usage."""
        print(f"roadatlas: {message}", file=sys.stderr)
        sys.exit(2)


def parse_arguments() -> argparse.Namespace:
    parser = _Parser(prog="roadatlas", description="Looks at a Road Atlas daemon.")
    _add_connection(parser, from_environment=True)
    commands = parser.add_subparsers(dest="command", required=True)
    _add_command(commands, "status", "what the atlas holds, and whom it takes us for")
    sync = _add_command(commands, "sync", "fetch the tiles of an area, coarse first")
    _add_area(sync)
    sync.add_argument("--out", type=pathlib.Path, required=True, metavar="DIR", help="a file LEVEL_X_Y.tile a tile")
    sync.add_argument("--sections", type=_number(int, 0, _MAX_U32), nargs="+", default=[], metavar="ID",
                      help="of docs/formats/tile.md [all]")
    sync.add_argument("--budget", type=_number(int, 0, _MAX_U64), default=0, metavar="BYTES",
                      help="of each reply [none]")
    watch = _add_command(commands, "watch", "tell what changes in an area")
    _add_area(watch)
    watch.add_argument("--interval", type=_number(float, 0, _MAX_U32 / 1000), default=1.0, metavar="S",
                       help="at most one event in this time [1]")
    watch.add_argument("--seconds", type=_number(float, 0, _MAX_U32), metavar="S",
                       help="how long [until it is interrupted]")
    return parser.parse_args()


def connect(arguments: argparse.Namespace) -> AtlasClient:
    """BadCredentials for flags that make no sense, too."""
    host, _, port = arguments.server.rpartition(":")
    if not port.isdecimal() or not 0 < int(port) < 1 << 16:
        raise BadCredentials(f"--server {arguments.server}: expected HOST:PORT")
    token = read_token(arguments.token_file) if arguments.token_file else ""
    return AtlasClient(host.strip("[]"), int(port), client_name="roadatlas", tls=_tls(arguments), token=token,
                       allow_plaintext=_is_plaintext_allowed(arguments.allow_plaintext))


def _tls(arguments: argparse.Namespace) -> Tls | None:
    if arguments.tls_ca:
        return Tls(arguments.tls_ca, arguments.tls_certificate or None, arguments.tls_key or None, arguments.tls_name)
    if arguments.tls_certificate or arguments.tls_key or arguments.tls_name:
        raise BadCredentials("--tls-certificate, --tls-key and --tls-name are of TLS: expected --tls-ca, too")
    return None


def _is_plaintext_allowed(text: str) -> bool:
    if text.lower() not in _TRUE + _FALSE:
        raise BadCredentials(f"ATLAS_ALLOW_PLAINTEXT={text}: expected true or false")
    return text.lower() in _TRUE


def _add_command(commands: argparse._SubParsersAction, name: str, summary: str) -> argparse.ArgumentParser:
    command = commands.add_parser(name, help=summary, description=summary)
    _add_connection(command, from_environment=False)
    return command


def _add_connection(parser: argparse.ArgumentParser, from_environment: bool) -> None:
    """Before and behind the command: only those before it have defaults, or these would undo what stands there."""
    def add(flag: str, variable: str, value_name: str, summary: str, default: str = "") -> None:
        given = os.environ.get(variable) or default
        parser.add_argument(flag, metavar=value_name, default=given if from_environment else argparse.SUPPRESS,
                            help=f"{summary} [{variable}{', else ' + default if default else ''}]")

    add("--server", "ATLAS_SERVER", "HOST:PORT", "the daemon", DEFAULT_SERVER)
    for name, value_name, summary in _SECURITY:
        add(f"--tls-{name}", f"ATLAS_TLS_{name.upper()}", value_name, summary)
    parser.add_argument("--allow-plaintext", action="store_const", const="true",
                        default=os.environ.get("ATLAS_ALLOW_PLAINTEXT", "") if from_environment else argparse.SUPPRESS,
                        help="speak without TLS beyond loopback, too [ATLAS_ALLOW_PLAINTEXT]")
    add("--token-file", "ATLAS_TOKEN_FILE", "FILE", "holds our token")


def _add_area(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--disc", nargs=3, type=_number(float, -_MAX_LENGTH_M, _MAX_LENGTH_M), required=True,
                        action=_Disc, metavar=("X", "Y", "R"), help="metres")
    parser.add_argument("--finest", type=_number(int, 0, _MAX_U32), default=0, metavar="LEVEL",
                        help="the finest level wanted [0]")


class _Disc(argparse.Action):

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: list[float],
                 option_string: str | None = None) -> None:
        x_m, y_m, radius_m = values
        if max(abs(x_m), abs(y_m)) > _MAX_PLACE_M or radius_m < 0:
            raise argparse.ArgumentError(self, f"expected X and Y within {_MAX_PLACE_M:g} m, R from 0 m")
        setattr(namespace, self.dest, values)


def _number(kind: type, least: float, most: float) -> Callable[[str], float]:
    """What argparse reads a number with that lies within both; nan does not."""
    def read(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"'{text}': expected {'a whole' if kind is int else 'a'} number from "
                                             f"{least:g} to {most:g}")
        return value
    return read
