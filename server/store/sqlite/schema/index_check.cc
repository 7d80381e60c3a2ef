#include "server/store/sqlite/schema/index_check.h"

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/schema/schema_check.h"
#include "server/store/sqlite/schema/table_order.h"

namespace atlas {
namespace {

constexpr std::uint64_t kRowsBetweenLooks = 1'024;

// The same columns by the table and by the index: so many integers, then texts.
struct CheckedIndex {
  const char* name;
  const char* by_table;
  const char* by_index;
  int integers;
  int texts = 0;
  const char* find = nullptr;  // by the first column, where that is the number of the row: SQLite
                               // reads that one from elsewhere than it searches by
};

#define BY_TABLE_AND_INDEX(columns, table, index)  \
  "SELECT " columns " FROM " table " NOT INDEXED", \
      "SELECT " columns " FROM " table " INDEXED BY " index
#define BY_KEY_AND_INDEX(columns, table, index)                                \
  "SELECT " columns " FROM " table " INDEXED BY sqlite_autoindex_" table "_1", \
      "SELECT " columns " FROM " table " INDEXED BY " index

constexpr CheckedIndex kIndexes[] = {
    {"of sessions by name",
     BY_TABLE_AND_INDEX("id, vehicle, session", "sessions", "sqlite_autoindex_sessions_1"), 1, 2},
    {"quarantined_sessions", "SELECT id FROM sessions NOT INDEXED WHERE state = 2",
     "SELECT id FROM sessions INDEXED BY quarantined_sessions WHERE state = 2", 1},
    {"of states by session",
     BY_TABLE_AND_INDEX(
         "session_id, revision, id", "session_states", "sqlite_autoindex_session_states_1"),
     3},
    {"of keyframes by name",
     BY_TABLE_AND_INDEX("session_id, sequence, id", "keyframes", "sqlite_autoindex_keyframes_1"),
     3},
    {"of poses by keyframe",
     BY_TABLE_AND_INDEX(
         "keyframe_id, revision, id", "pose_history", "sqlite_autoindex_pose_history_1"),
     3},
    {"tiles_of_keyframe",
     BY_KEY_AND_INDEX("keyframe_id, tile_key", "keyframe_tiles", "tiles_of_keyframe"), 2},
    {"changes_of_tile",
     BY_KEY_AND_INDEX("tile_key, revision, keyframe_id, is_current, checksum",
                      "keyframe_tiles",
                      "changes_of_tile"),
     5},
    {"tile_summaries",
     BY_TABLE_AND_INDEX("key, revision, fused_revision, payload_hash, cells, multilayer_cells, "
                        "blob_bytes, blob_hash, checksum",
                        "tiles",
                        "tile_summaries"),
     9, 0, "SELECT 1 FROM tiles INDEXED BY tile_summaries WHERE key = ?"},
    {"dirty_since", BY_TABLE_AND_INDEX("since, key", "dirty_tiles", "dirty_since"), 2},
    {"tombstones_of_compaction",
     BY_KEY_AND_INDEX(
         "compaction_id, session_id, sequence", "tombstones", "tombstones_of_compaction"),
     3},
};

#undef BY_TABLE_AND_INDEX
#undef BY_KEY_AND_INDEX

// Each step is a bijection, so that rows which differ in one column do not hash alike.
std::uint64_t Mix(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9E3779B97F4A7C15U;
  return hash ^ (hash >> 32U);
}

struct Contents {
  std::uint64_t rows = 0;
  std::uint64_t hashes = 0;  // their sum: in whatever order they come

  bool operator==(const Contents&) const = default;
};

Status CheckIndex(Connection& connection,
                  const CheckedIndex& index,
                  const std::function<Status()>& check_stop) {
  Contents by_table;
  Contents by_index;
  bool is_found = true;
  for (const bool is_index : {false, true}) {
    Contents& contents = is_index ? by_index : by_table;
    Query row = connection.Prepare(is_index ? index.by_index : index.by_table);
    while (row.Step()) {
      row.Rewind();
      std::uint64_t hash = 0;
      for (int i = 0; i < index.integers; ++i) {
        const std::int64_t value = row.Int();
        hash = Mix(hash, static_cast<std::uint64_t>(value));
        if (i == 0 && is_index && index.find != nullptr) {
          Query found = connection.Prepare(index.find);
          found.Bind(value);
          is_found = is_found && found.Step();
        }
      }
      for (int i = 0; i < index.texts; ++i) {
        hash = Mix(hash,
                   static_cast<std::uint64_t>(RowHash(RowKind::kSession).Text(row.Text()).value()));
      }
      contents.hashes += Mix(hash, 1);
      if (++contents.rows % kRowsBetweenLooks == 0) {
        ATLAS_RETURN_IF_ERROR(check_stop());
      }
    }
  }
  return by_table == by_index && is_found
             ? Status()
             : Status(StatusCode::kInvalidData,
                      StrCat("store: the index ", index.name, " is damaged: it has ", by_index.rows,
                             " rows, and its table ", by_table.rows,
                             by_index.rows == by_table.rows ? ", not all the same" : ""));
}

std::vector<StructureCheck> ListChecks(const std::function<Status()>& check_stop) {
  std::vector<StructureCheck> checks{&CheckSchema, &CheckIndexes};
  AddOrderChecks(check_stop, checks);
  for (const CheckedIndex& index : kIndexes) {
    checks.emplace_back([&index, check_stop](Connection& connection) {
      return CheckIndex(connection, index, check_stop);
    });
  }
  return checks;
}

}  // namespace

Status CheckStructure(const std::function<Status(const StructureCheck&)>& run,
                      const std::function<Status()>& check_stop) {
  std::string findings;
  for (const StructureCheck& check : ListChecks(check_stop)) {
    ATLAS_RETURN_IF_ERROR(check_stop());
    if (Status status = run(check); status.code() == StatusCode::kInvalidData) {
      findings += StrCat(findings.empty() ? "" : "; ", status.message());
    } else if (!status.ok()) {
      return status;
    }
  }
  return findings.empty() ? Status() : Status(StatusCode::kInvalidData, findings);
}

}  // namespace atlas
