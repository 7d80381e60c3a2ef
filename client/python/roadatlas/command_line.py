"""Flags of `python3 -m roadatlas`, and the connection that they and the environment describe (docs/python.md)."""

import argparse
import os
import pathlib

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


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="roadatlas", description="Looks at a Road Atlas daemon.")
    _add_connection(parser, from_environment=True)
    commands = parser.add_subparsers(dest="command", required=True)
    _add_command(commands, "status", "what the atlas holds, and whom it takes us for")
    sync = _add_command(commands, "sync", "fetch the tiles of an area, coarse first")
    _add_area(sync)
    sync.add_argument("--out", type=pathlib.Path, required=True, metavar="DIR", help="a file LEVEL_X_Y.tile a tile")
    sync.add_argument("--sections", type=int, nargs="+", default=[], metavar="ID",
                      help="of docs/formats/tile.md [all]")
    sync.add_argument("--budget", type=int, default=0, metavar="BYTES", help="of each reply [none]")
    watch = _add_command(commands, "watch", "tell what changes in an area")
    _add_area(watch)
    watch.add_argument("--interval", type=float, default=1.0, metavar="S", help="at most one event in this time [1]")
    watch.add_argument("--seconds", type=float, metavar="S", help="how long [until it is interrupted]")
    return parser.parse_args()


def connect(arguments: argparse.Namespace) -> AtlasClient:
    """BadCredentials for flags that make no sense, too."""
    host, _, port = arguments.server.rpartition(":")
    if not port.isdigit():
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
    parser.add_argument("--disc", nargs=3, type=float, required=True, metavar=("X", "Y", "R"), help="metres")
    parser.add_argument("--finest", type=int, default=0, metavar="LEVEL", help="the finest level wanted [0]")
