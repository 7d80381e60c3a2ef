"""Backups and restores that are refused: names, folders, disks, roles, and files that are no backups."""

import hashlib
import os
import pathlib
import shutil
import subprocess

from daemon_cases import damage, fill, made_atlas, refuses_to_start, small_disk
from harness import NEAR, SMALL, Daemon, Drives


def contents(folder):
    return {file.relative_to(folder): file.stat().st_mtime_ns for file in sorted(pathlib.Path(folder).rglob("*"))}


def name_cases(cases, drives, work):
    cases.refused("backup, a daemon without a folder", ["backup", "monday"], "invalid_argument", "backup.folder")
    cases.refused("backups, a daemon without a folder", ["backups"], "invalid_argument", "backup.folder")
    folder = pathlib.Path(work, "backups")
    folder.mkdir()
    with Daemon(cases.bin_dir, work + "/named", *SMALL, "--backup-folder", str(folder)) as daemon:
        client = type(cases)(cases.report, cases.bin_dir, daemon.server)
        client.run("ingest", drives.good, *NEAR)
        for name in ("../monday", "a/b", ".", "..", "", "a b", "x" * 65, ".hidden", "a.partial", "a-wal"):
            client.refused(f"backup {name!r}", ["backup", name], "invalid_argument")
        cases.report.equal("no file of a refused name", os.listdir(folder), [])
        client.run("wait")
        done = client.accepted("backup, at last", ["backup", "monday"])
        cases.report.equal("backup, at last: digest", done["digest"], client.run("digest")["digest"])
        cases.report.equal("backups", [line["name"] for line in client.run("backups")["backups"]], ["monday"])
        before = contents(folder)
        client.refused("backup, a name that is there", ["backup", "monday"], "conflict", "monday")
        client.refused("backup, no time for it", ["backup", "tuesday", "--timeout", "0"], "timeout")
        cases.report.equal("the backup that was there", contents(folder), before)
        point = client.run("point", "0", "-1.6")["layers"]
        read = subprocess.run([cases.bin_dir / "atlas", "point", "0", "-1.6", "--json", "--atlas", folder / "monday"],
                              capture_output=True, text=True, check=False)
        cases.report.check("a backup is an atlas file", read.returncode == 0 and point != []
                           and '"z_m":' in read.stdout, read.stderr)
        shutil.rmtree(folder)
        client.refused("backup, its folder is gone", ["backup", "monday"], "not_found", "backups")
    refuses_to_start(cases, "backups among the atlas's files", work + "/named", ["--backup-folder", work + "/named"], 2,
                     "invalid_argument: .*backup.folder")


def role_cases(cases, work):
    folder = pathlib.Path(work, "by_role")
    folder.mkdir()
    tokens = pathlib.Path(work, "tokens")
    tokens.write_text("".join(f"{role} {role} never {hashlib.sha256(role.encode()).hexdigest()}\n"
                              for role in ("reader", "merge", "admin")), encoding="ascii")
    with Daemon(cases.bin_dir, work + "/roles", *SMALL, "--backup-folder", str(folder), "--tokens", str(tokens)) as daemon:
        client = type(cases)(cases.report, cases.bin_dir, daemon.server)
        for role, code in (("reader", 1), ("merge", 1), ("admin", 0)):
            token = pathlib.Path(work, role)
            token.write_text(role + "\n", encoding="ascii")
            for command in (["backup", role], ["backups"]):
                done = client.call(*command, "--token-file", token, "--json")
                cases.report.equal(f"{command}, as {role}: exit code", done.returncode, code)
                if code != 0:
                    client.typed(f"{command}, as {role}", done.stderr, "permission_denied", "may not")
    cases.report.equal("backups of whoever may", os.listdir(folder), ["admin"])


def disk_cases(cases, drives, work):
    with small_disk(work + "/full", "size=8m") as disk:
        if disk is None:
            cases.report.skip("a backup on a full disk", "a small file system cannot be mounted here")
            return
        with Daemon(cases.bin_dir, work + "/beside", *SMALL, "--backup-folder", disk) as daemon:
            client = type(cases)(cases.report, cases.bin_dir, daemon.server)
            client.run("ingest", drives.good, *NEAR)
            client.refused("backup, no room", ["backup", "monday"], "resource_exhausted", "bytes")
        cases.report.equal("backup, no room: nothing is left", os.listdir(disk), [])
        backup = made_atlas(cases, drives, work + "/large")
        fill(pathlib.Path(disk) / "ballast")
        cases.refused("restore, no room", ["restore", backup, "--to", disk + "/data/atlas.db"], "resource_exhausted",
                      "bytes")
        cases.report.check("restore, no room: no atlas", not list(pathlib.Path(disk, "data").glob("atlas.db*")))
    if cases.unprivileged is not None:
        folder, data = pathlib.Path(work, "closed"), pathlib.Path(work, "open")
        folder.mkdir(mode=0o555)
        data.mkdir()
        data.chmod(0o777)
        with Daemon(cases.bin_dir, data, *SMALL, "--backup-folder", str(folder), **cases.unprivileged) as daemon:
            client = type(cases)(cases.report, cases.bin_dir, daemon.server)
            client.refused("backup, a folder that cannot be written to", ["backup", "monday"], "permission_denied")
        cases.forbidden("restore, a folder that cannot be written to",
                        ["restore", made_atlas(cases, drives, work + "/readable"), "--to", folder / "atlas.db"], "closed")


def restore_cases(cases, drives, work):
    whole = made_atlas(cases, drives, work + "/whole")
    target = pathlib.Path(work, "target/atlas.db")

    def refused(name, backup, code, says, *more, to=target):
        before = contents(work)
        cases.refused(f"restore, {name}", ["restore", backup, "--to", to, *more], code, says)
        cases.report.equal(f"restore, {name}: the files", contents(work), before)

    def spoiled(name, statement=None, content=None, size=None):
        backup = pathlib.Path(work, name)
        shutil.copy(whole, backup)
        if statement is not None:
            damage(backup, statement)
        if content is not None:
            backup.write_bytes(content)
        if size is not None:
            os.truncate(backup, size)
        return backup

    refused("no file", work + "/nowhere", "not_found", "nowhere")
    refused("a folder", work, "invalid_argument", "directory")
    refused("no atlas", spoiled("garbage", content=b"not a database" * 1000), "invalid_data", "garbage")
    refused("nothing", spoiled("empty", content=b""), "invalid_data", "empty")
    refused("half of one", spoiled("half", size=whole.stat().st_size // 2), "invalid_data", "half")
    refused("a damaged row", spoiled("row", "UPDATE poses SET x_um = x_um + 1"), "invalid_data", "row")
    refused("a damaged blob", spoiled("blob", "UPDATE keyframes SET blob = zeroblob(length(blob))"), "invalid_data", "blob")
    refused("a missing row", spoiled("gone", "DELETE FROM tiles"), "invalid_data", "gone")
    refused("a newer schema", spoiled("newer", "PRAGMA user_version = 99"), "unsupported", "schema")
    refused("another name", whole, "invalid_argument", "atlas.db", to=pathlib.Path(work, "target/other.db"))
    refused("itself", whole, "invalid_argument", "itself", "--replace", to=whole)
    shutil.copytree(whole.parent, target.parent)
    refused("an atlas that is there", whole, "conflict", "already")
    with Daemon(cases.bin_dir, target.parent) as daemon:
        client = type(cases)(cases.report, cases.bin_dir, daemon.server)
        client.refused("restore, a daemon that runs", ["restore", whole, "--to", target, "--replace"], "conflict",
                       "in use by process")
        digest = client.run("digest")["digest"]
    done = cases.accepted("restore, at last", ["restore", whole, "--to", target, "--replace"])
    cases.report.equal("restore, at last: digest", done["digest"], digest)
    cases.report.check("restore, at last: what was there", pathlib.Path(done["kept"]).is_file(), done)
    with Daemon(cases.bin_dir, target.parent) as daemon:
        client = type(cases)(cases.report, cases.bin_dir, daemon.server)
        cases.report.equal("restored: digest", client.run("digest")["digest"], digest)
        cases.report.equal("restored: verify", client.run("verify", "--rebuild")["damaged"], 0)
        cases.report.equal("restored: event", client.run("log")["events"][-1]["kind"], "backup_restored")
    target.rename(str(target) + ".partial")
    refuses_to_start(cases, "an interrupted restore", target.parent, [], 4, "conflict: .*restore was interrupted")


def run(cases, source, work):
    drives = Drives(source, work + "/drives")
    name_cases(cases, drives, work)
    role_cases(cases, work)
    disk_cases(cases, drives, work)
    restore_cases(cases, drives, work)
