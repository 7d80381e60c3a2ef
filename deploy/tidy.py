"""Runs clang-tidy over the files of a compilation database, with g++'s own flags left out."""

import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import tempfile

GCC_ONLY = {"-fvect-cost-model=dynamic", "-Wduplicated-cond", "-Wlogical-op", "-Wno-restrict"}


def main():
    database, *named = sys.argv[1:]
    wanted = {str(pathlib.Path(name).resolve()) for name in named}
    build = pathlib.Path(database).resolve().parent
    entries = []
    for entry in json.loads(pathlib.Path(database).read_text()):
        if build in pathlib.Path(entry["file"]).parents or (wanted and entry["file"] not in wanted):
            continue
        words = [word for word in entry["command"].split() if word not in GCC_ONLY and "ccache" not in word]
        entries.append({**entry, "command": " ".join(words)})
    missing = wanted - {entry["file"] for entry in entries}
    if missing:
        sys.exit(f"not built, so not checked: {', '.join(sorted(missing))}")
    failed = 0
    with tempfile.TemporaryDirectory() as work:
        (pathlib.Path(work) / "compile_commands.json").write_text(json.dumps(entries))
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            checks = [pool.submit(subprocess.run, ["clang-tidy", "-p", work, "--quiet", entry["file"]],
                                  capture_output=True, text=True) for entry in entries]
            for done, check in enumerate(concurrent.futures.as_completed(checks), 1):
                result = check.result()
                if result.returncode != 0:
                    failed += 1
                    print(result.stdout or result.stderr, flush=True)
                if sys.stderr.isatty():
                    print(f"\rtidy: {done} of {len(entries)} files", end="", file=sys.stderr)
    print(f"tidy: {len(entries)} files, findings in {failed}", flush=True)
    sys.exit(1 if failed or not entries else 0)


main()
