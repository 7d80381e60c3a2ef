#!/usr/bin/python3
"""The floors of the house (docs/architecture.md) as a test: who may include whom.

Usage: include_rule_test.py SOURCE_DIR. Prints each broken rule and exits 1 if there is one.
"""

import pathlib
import re
import sys

# Folder -> folders of this repository that its files may include, besides their own, and single headers
# of others. A folder that is not listed here must not hold sources.
FLOOR_1 = ["core/base", "core/geometry"]
FLOOR_2 = FLOOR_1 + ["core/scan"]
FLOOR_3 = FLOOR_2 + ["core/traversability", "core/grid", "core/column"]
FLOOR_4 = FLOOR_3 + ["core/keyframe", "core/tile"]
SERVER = FLOOR_1 + ["server/base"]
FUSED = SERVER + ["core/keyframe", "core/tile", "core/fusion", "core/fusion/observation", "server/store"]
STORE = SERVER + ["server/store"]
WIRE = ["proto/wire", "proto/roadatlas/v1"]
SERVING = SERVER + WIRE + ["server/service"]
NET = ["server/net/byte_budget.h", "server/net/net_counters.h", "server/net/net_options.h",
       "server/net/peer_record.h", "server/net/peer_share.h", "server/net/places.h",
       "server/net/server_security.h"]
NET_ROOMS = ["server/net", "server/net/connection", "server/net/requests", "server/net/stream"]
COMMAND_ROOMS = ["client/cli/command_line", "client/cli/files", "client/cli/output", "client/connection"]
ALLOWED = {
    "core/base": [],
    "core/geometry": ["core/base"],
    "core/scan": FLOOR_1 + ["core/scan/rings"],
    "core/scan/rings": FLOOR_1 + ["core/scan/ego_box.h", "core/scan/fast_atan2.h", "core/scan/point_cloud.h"],
    "core/traversability": FLOOR_2,
    "core/grid": FLOOR_2,
    "core/column": FLOOR_2,
    "core/keyframe": FLOOR_3,
    "core/tile": FLOOR_3,
    "core/fusion": FLOOR_4 + ["core/fusion/combination", "core/fusion/observation", "core/fusion/segment",
                              "core/fusion/survey"],
    "core/fusion/observation": FLOOR_4,
    "core/fusion/segment": FLOOR_4,
    "core/fusion/survey": FLOOR_4 + ["core/fusion/observation", "core/fusion/segment",
                                     "core/fusion/fusion_context.h"],
    "core/fusion/combination": FLOOR_4 + ["core/fusion/observation", "core/fusion/segment"],
    "core/localization": FLOOR_4 + ["core/localization/belief", "core/localization/odometry",
                                    "core/localization/places", "core/localization/registration",
                                    "core/localization/tracking", "core/localization/window"],
    "core/localization/belief": FLOOR_4 + ["core/localization/registration", "core/localization/window"],
    "core/localization/icp": FLOOR_4 + ["core/localization/window/local_map.h"],
    "core/localization/monitor": FLOOR_4 + ["core/localization/registration/pose_prior.h",
                                            "core/localization/window/local_map.h"],
    "core/localization/odometry": FLOOR_4 + ["core/localization/icp/point_index.h",
                                             "core/localization/registration"],
    "core/localization/places": FLOOR_4,
    "core/localization/registration": FLOOR_4 + ["core/localization/window"],
    "core/localization/tracking": FLOOR_4 + ["core/localization/belief", "core/localization/odometry",
                                             "core/localization/places/place_index.h",
                                             "core/localization/registration", "core/localization/window"],
    "core/localization/window": FLOOR_4,
    "core/alignment": FLOOR_4 + ["core/fusion", "core/fusion/observation",
                                 "core/localization/places", "core/localization/registration",
                                 "core/localization/window"],
    "core/planning": FLOOR_4 + ["core/planning/coarse", "core/planning/route", "core/planning/search",
                                "core/planning/surface"],
    "core/planning/surface": FLOOR_4 + ["core/planning/plan_budget.h", "core/planning/plan_options.h",
                                        "core/planning/tile_source.h"],
    "core/planning/coarse": FLOOR_4 + ["core/planning/plan_budget.h", "core/planning/plan_options.h",
                                       "core/planning/surface", "core/planning/tile_source.h"],
    "core/planning/search": FLOOR_4 + ["core/planning/coarse", "core/planning/plan_budget.h",
                                       "core/planning/plan_options.h", "core/planning/surface",
                                       "core/planning/tile_source.h"],
    "core/planning/route": FLOOR_4 + ["core/planning/plan_options.h", "core/planning/surface"],
    "core/simulation": FLOOR_4 + ["core/simulation/mesh", "core/simulation/worlds"],
    "core/simulation/city": FLOOR_4 + ["core/simulation", "core/simulation/mesh", "core/simulation/worlds"],
    "core/simulation/mesh": FLOOR_4 + ["core/simulation"],
    "core/simulation/worlds": FLOOR_4 + ["core/simulation", "core/simulation/mesh"],
    "proto/wire": FLOOR_1 + ["proto/roadatlas/v1"],
    "server/base": FLOOR_1,
    "server/store": SERVER,
    "server/store/sqlite": STORE + ["server/store/sqlite/backup", "server/store/sqlite/connection", "server/store/sqlite/migrations",
                                    "server/store/sqlite/schema", "server/store/sqlite/tables",
                                    "server/store/sqlite/transactions"],
    "server/store/sqlite/backup": STORE + ["server/store/sqlite/connection", "server/store/sqlite/schema",
                                           "server/store/sqlite/tables", "server/store/sqlite/transactions"],
    "server/store/sqlite/connection": SERVER + ["server/store/write_figures.h"],
    "server/store/sqlite/schema": STORE + ["server/store/sqlite/connection"],
    "server/store/sqlite/migrations": STORE + ["server/store/sqlite/connection", "server/store/sqlite/schema",
                                               "server/store/sqlite/tables"],
    "server/store/sqlite/tables": STORE + ["server/store/sqlite/connection", "server/store/sqlite/schema"],
    "server/store/sqlite/transactions": STORE + ["server/store/sqlite/connection", "server/store/sqlite/schema",
                                                 "server/store/sqlite/tables"],
    "client/connection": FLOOR_1 + WIRE,
    "client/score": FLOOR_1,
    "client/map": FLOOR_1 + ["core/tile", "client/connection"],
    "client/vehicle": FLOOR_1 + ["core/tile", "client/connection", "client/map"],
    "client/onboard": FLOOR_1 + ["core/tile", "core/localization", "core/localization/places",
                                 "core/localization/window/local_map.h", "core/planning", "client/vehicle"],
    "client/atlas_file": FLOOR_1 + ["client/connection", "client/map", "client/vehicle", "server/store",
                                   "core/tile", "server/store/sqlite/restore.h",
                                   "server/store/sqlite/store_snapshot.h"],
    "client/drive": FLOOR_4 + ["core/localization", "core/localization/icp", "core/localization/monitor",
                               "core/localization/places", "core/localization/window/local_map.h",
                               "client/connection", "client/drive/anchor",
                               "client/map", "client/score", "client/vehicle/atlas_link.h"],
    "client/drive/anchor": FLOOR_4 + ["core/localization", "core/localization/places",
                                      "core/localization/registration/pose_prior.h", "client/connection", "client/drive/drive_survey.h",
                                      "client/drive/impossible_steps.h", "client/drive/place_reader.h", "client/drive/scan_localizer.h",
                                      "client/drive/tiles_around.h", "client/map"],
    "client/export": FLOOR_1 + ["core/tile"],
    "client/merge/graph": FLOOR_1,
    "client/merge/plan": FLOOR_1 + ["core/keyframe", "core/alignment",
                                    "core/fusion/observation/keyframe_placement.h", "core/fusion/tile_fusion.h",
                                    "client/merge/graph", "client/merge/memory"],
    "client/merge/memory": FLOOR_1 + ["core/alignment", "core/localization/registration/pose_search.h", "client/vehicle/folder_lock.h",
                                    "client/vehicle/stored_file.h"],
    "client/merge/changes": FLOOR_1 + ["core/keyframe", "core/tile", "core/fusion", "core/fusion/observation",
                                       "core/localization/window", "client/merge/plan"],
    "client/merge/report": FLOOR_1 + ["core/tile", "client/merge/changes", "client/merge/plan", "client/render", "client/render/plot"],
    "client/merge/source": FLOOR_1 + ["core/keyframe", "client/atlas_file", "client/connection", "client/merge/plan"],
    "client/merge/output": FLOOR_1 + ["client/atlas_file", "client/connection", "client/merge/memory/temporary_folder.h"],
    "client/merge/serve": FLOOR_1 + ["client/connection", "client/merge", "client/merge/plan", "client/merge/source",
                                     "client/merge/memory", "client/vehicle/atlas_link.h"],
    "client/merge": FLOOR_1 + ["core/tile", "client/connection", "client/merge/changes", "client/merge/plan", "client/merge/report", "client/merge/source",
                               "client/merge/memory", "client/render/image.h"],
    "client/render": FLOOR_1 + ["core/tile"],
    "client/render/plot": FLOOR_1 + ["client/render"],
    "server/service": FUSED + ["server/service/backup", "server/service/compaction", "server/service/fusion", "server/service/history",
                               "server/service/region", "server/service/sync", "server/service/verification",
                               "server/service/watch"],
    "server/service/backup": STORE + ["core/tile", "server/service/log_sink.h"],
    "server/service/fusion": FUSED + ["server/service/change_signal.h", "server/service/log_sink.h",
                                     "server/service/process_memory.h"],
    "server/service/region": STORE + ["core/tile"],
    "server/service/sync": STORE + ["core/tile"],
    "server/service/watch": FLOOR_1 + ["server/service/sync"],
    "server/service/verification": FUSED + ["server/service/change_signal.h", "server/service/fusion",
                                            "server/service/log_sink.h", "server/service/upload_check.h"],
    "server/service/compaction": FUSED + ["server/service/fusion", "server/service/log_sink.h",
                                          "server/service/upload_check.h"],
    "server/service/history": FUSED + ["server/service/fusion", "server/service/region",
                                       "server/service/verification"],
    "server/net": SERVING + ["server/net/access", "server/net/connection", "server/net/requests",
                             "server/net/stream/tls_context.h"],
    "server/net/access": FLOOR_1 + WIRE + ["server/net/stream/tls_context.h"],
    "server/net/connection": SERVING + NET + ["server/net/access", "server/net/requests", "server/net/stream"],
    "server/net/requests": SERVING + NET + ["core/tile", "server/net/access", "server/net/stream"],
    "server/net/stream": FLOOR_1 + WIRE + NET,
    "server/http": STORE + ["server/service", "server/net/listen_socket.h", "server/net/net_counters.h",
                            "server/net/places.h"],
    "server/config": FLOOR_1,
    "server": SERVER + ["server/config", "server/http", "server/net", "server/net/access",
                        "server/net/stream/tls_context.h", "server/service", "server/store",
                         "server/store/sqlite"],
    "client/cli/output": FLOOR_4,
    "client/cli/files": FLOOR_1 + ["client/cli/output", "client/connection", "client/merge/changes/map_change.h",
                                   "core/localization/monitor/contradiction.h"],
    "client/cli/command_line": FLOOR_1 + ["client/cli/output", "client/connection"],
    "client/cli/map_input": FLOOR_1 + ["client/atlas_file", "client/cli/command_line", "client/connection",
                                       "client/map"],
    "client/cli/commands/atlas": FLOOR_1 + COMMAND_ROOMS + ["client/atlas_file"],
    "client/cli/commands/map": FLOOR_4 + COMMAND_ROOMS + ["core/localization/monitor/contradiction.h", "core/planning", "client/cli/map_input", "client/export", "client/map", "client/render", "client/score"],
    "client/cli/commands/drive": FLOOR_4 + COMMAND_ROOMS + ["core/localization/monitor", "core/simulation", "core/simulation/city",
                                                            "core/simulation/mesh", "client/cli/map_input",
                                                            "client/drive", "client/drive/anchor", "client/map", "client/render",
                                                            "client/render/plot", "client/score",
                                                            "client/vehicle/atlas_link.h"],
    "client/cli/commands/merge": FLOOR_1 + COMMAND_ROOMS + ["client/atlas_file", "client/cli/commands/atlas/author_flag.h",
                                                            "client/merge", "client/merge/serve",
                                                            "client/merge/output", "client/merge/report", "client/merge/source"],
    "client/cli/commands": ["client/cli/command_line", "client/cli/commands/atlas", "client/cli/commands/drive",
                            "client/cli/commands/map"],
    "client/cli": FLOOR_1 + ["client/cli/command_line", "client/cli/commands", "client/cli/commands/merge"],
}
NET_ROOMS = ["server/net", "server/net/connection", "server/net/requests", "server/net/stream"]
# Libraries that stay behind a few doors: pattern -> folders that may include it.
FENCED = {
    r"<boost/asio": NET_ROOMS + ["server/http", "server", "client/connection"],
    r"<boost/beast": ["server/http"],
    r"<prometheus": ["server/http"],
    r"\.pb\.h\"": ["proto/wire", *NET_ROOMS, "client/connection"],
    r"<openssl": ["server/net/access", "server/net/stream", "server/store"],
    r"<SQLiteCpp|<sqlite3": ["server/store/sqlite/connection"],
    r"<CLI/": ["client/cli/command_line", "server/config"],
    r"<toml\+\+": ["server/config"],
    r"<spdlog": NET_ROOMS + ["server", "server/base", "server/config", "server/http"],
    r"<zstd|<xxhash": ["core/base"],
    r"<png": ["client/render"],
    r"<nanoflann": ["core/localization/icp"],
    r"<ceres": ["client/merge/graph"],
}
# core is pure: what its files may include in angle brackets. No clock, thread, lock, randomness, socket, process,
# nor anything of the operating system; files only where scans and meshes are read and written.
PURE = set("""
    algorithm array bit cassert charconv climits cmath compare concepts cstddef cstdint cstdlib cstring deque
    functional initializer_list iosfwd iterator limits list map memory memory_resource numbers numeric optional ostream queue set span
    sstream string string_view system_error tuple type_traits unordered_map unordered_set utility variant vector
    Eigen/Cholesky Eigen/Core Eigen/Eigenvalues Eigen/Geometry Eigen/LU tl/expected.hpp
    """.split())
DOORS = {
    "core/base": {"cerrno", "filesystem", "xxhash.h", "zstd.h"},  # names of files and errors of them
    "core/localization/icp": {"nanoflann.hpp"},
    "core/scan": {"filesystem", "fstream"},
    "core/simulation": {"cerrno", "cstdio", "filesystem"},
    "core/simulation/city": {"atomic"},  # a cache of chunks, whichever thread casts
    "core/simulation/mesh": {"filesystem"},
}
IMPURE_CALL = re.compile(r"\bstd::(?:rand|srand|getenv|system|atexit)\b")  # in <cstdlib>
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"][^>"]+[>"])', re.M)


def broken_rules(root):
    for side in ("core", "proto", "server", "client"):
        for path in sorted((root / side).rglob("*")):
            if path.suffix not in (".h", ".cc"):
                continue
            folder = path.parent.relative_to(root).as_posix()
            if folder not in ALLOWED:
                yield path, f"folder {folder} has no floor: add it to docs/architecture.md and here"
                continue
            text = path.read_text(encoding="utf-8")
            for include in INCLUDE.findall(text):
                yield from check(path, folder, include)
            if side == "core":
                for call in IMPURE_CALL.findall(text):
                    yield path, f"uses {call}: core is pure"


def check(path, folder, include):
    if include.startswith('"'):
        header = include.strip('"')
        target = header.rpartition("/")[0]
        if target != folder and target not in ALLOWED[folder] and header not in ALLOWED[folder]:
            yield path, f"includes {include}: {folder} may not see {target or 'the top'}"
    elif folder.startswith("core/") and include.strip("<>") not in PURE | DOORS.get(folder, set()):
        yield path, f"includes {include}: core is pure, and this is not in the list of what that allows"
    for pattern, doors in FENCED.items():
        if re.search(pattern, include) and folder not in doors:
            yield path, f"includes {include}: only {', '.join(doors)} may"


def main():
    root = pathlib.Path(sys.argv[1])
    found = list(broken_rules(root))
    for path, message in found:
        print(f"{path.relative_to(root)}: {message}")
    files = sum(1 for side in ("core", "proto", "server", "client")
                for path in (root / side).rglob("*") if path.suffix in (".h", ".cc"))
    if files == 0:
        print(f"no sources below {root}")
        return 1
    print(f"{files} files, {len(found)} broken rules")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
