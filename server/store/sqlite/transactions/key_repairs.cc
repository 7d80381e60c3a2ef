#include "server/store/sqlite/transactions/key_repairs.h"

#include <algorithm>
#include <exception>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/event_types.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/keyframe_row.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/transactions/history_horizon.h"
#include "server/store/sqlite/transactions/keyframe_twins.h"

namespace atlas {
namespace {

struct RowKey {
  std::int64_t first = 0;
  std::int64_t second = 0;

  auto operator<=>(const RowKey&) const = default;
};

// A table whose rows have an id, and a key of two integers that an index allows once.
struct KeyedTable {
  const char* name;
  const char* by_index;   // id and key of all rows, by the index
  const char* twins;      // key and id of rows with the key of another one, in this order
  const char* write_key;  // of an id
  const char* remove;     // an id
  const char* checksums;  // of two ids: whether they are one
  const char* reindex;
  std::vector<std::int64_t> (*list_damaged)(Connection&);
  bool (*is_under)(Connection&, std::int64_t id, std::int64_t first, std::int64_t second);
};

constexpr KeyedTable kStates = {
    "session_states",
    "SELECT id, session_id, revision FROM session_states INDEXED BY "
    "sqlite_autoindex_session_states_1",
    "SELECT session_id, revision, id FROM session_states NOT INDEXED WHERE (session_id, revision) "
    "IN (SELECT session_id, revision FROM session_states NOT INDEXED GROUP BY 1, 2 "
    "HAVING count(*) > 1) ORDER BY 1, 2, 3",
    "UPDATE session_states SET session_id = ?, revision = ? WHERE id = ?",
    "DELETE FROM session_states WHERE id = ?",
    "SELECT min(checksum) = max(checksum) FROM session_states WHERE id IN (?, ?)",
    "REINDEX session_states",
    &ListDamagedSessionStates,
    &IsSessionStateUnder};
constexpr KeyedTable kPoseLines = {
    "pose_history",
    "SELECT id, keyframe_id, revision FROM pose_history INDEXED BY sqlite_autoindex_pose_history_1",
    "SELECT keyframe_id, revision, id FROM pose_history NOT INDEXED WHERE (keyframe_id, revision) "
    "IN (SELECT keyframe_id, revision FROM pose_history NOT INDEXED GROUP BY 1, 2 "
    "HAVING count(*) > 1) ORDER BY 1, 2, 3",
    "UPDATE pose_history SET keyframe_id = ?, revision = ? WHERE id = ?",
    "DELETE FROM pose_history WHERE id = ?",
    "SELECT min(checksum) = max(checksum) FROM pose_history WHERE id IN (?, ?)",
    "REINDEX pose_history",
    &ListDamagedPoseLines,
    &IsPoseLineUnder};
constexpr KeyedTable kKeyframes = {
    "keyframes",
    "SELECT id, session_id, sequence FROM keyframes INDEXED BY sqlite_autoindex_keyframes_1",
    "SELECT session_id, sequence, id FROM keyframes NOT INDEXED WHERE (session_id, sequence) "
    "IN (SELECT session_id, sequence FROM keyframes NOT INDEXED GROUP BY 1, 2 "
    "HAVING count(*) > 1) ORDER BY 1, 2, 3",
    "UPDATE keyframes SET session_id = ?, sequence = ? WHERE id = ?",
    nullptr,
    nullptr,
    "REINDEX keyframes",
    &ListDamagedKeyframeRows,
    &IsKeyframeRowUnder};

// Sorted. Of an index that cannot be read to its end: what was read before.
std::vector<std::pair<std::int64_t, RowKey>> KeysByIndex(Connection& connection,
                                                         const KeyedTable& table,
                                                         const std::vector<std::int64_t>& ids) {
  std::vector<std::pair<std::int64_t, RowKey>> keys;
  try {
    Query row = connection.Prepare(table.by_index);
    while (row.Step()) {
      row.Rewind();
      const std::int64_t id = row.Int();
      if (std::binary_search(ids.begin(), ids.end(), id)) {
        keys.emplace_back(id, RowKey{row.Int(), row.Int()});
      }
    }
  } catch (const std::exception& error) {
    if (StatusFromException(error).code() != StatusCode::kInvalidData) {
      throw;
    }
  }
  return keys;
}

std::map<RowKey, std::vector<std::int64_t>> ListTwins(Connection& connection,
                                                      const KeyedTable& table) {
  std::map<RowKey, std::vector<std::int64_t>> twins;
  Query row = connection.Prepare(table.twins);
  while (row.Step()) {
    row.Rewind();
    const RowKey key{row.Int(), row.Int()};
    twins[key].push_back(row.Int());
  }
  return twins;
}

bool IsSameKeyframe(Connection& connection, std::int64_t a, std::int64_t b) {
  const auto first = ReadKeyframeRow(connection, a);
  const auto second = ReadKeyframeRow(connection, b);
  return first && second && first->blob_hash == second->blob_hash &&
         first->record.time_ms == second->record.time_ms;
}

class KeyRepair {
 public:
  KeyRepair(Connection& connection, const std::string& author)
      : connection_(connection), author_(author) {}

  std::uint32_t Run() {
    connection_.Execute("REINDEX keyframe_tiles; REINDEX tiles; REINDEX dirty_tiles");
    for (const KeyedTable* table : {&kStates, &kPoseLines, &kKeyframes}) {
      const ToleratedIndexes tolerated(connection_);
      RestoreKeys(*table);
      SettleTwinsOf(*table);
      connection_.Execute(table->reindex);
      if (table == &kKeyframes) {
        RestoreNumbers();
      }
    }
    if (has_lost_history_) {
      MoveHorizon(connection_, author_);
    }
    return repaired_;
  }

 private:
  // Of keyframes whose number alone has a turned bit. Those of lines mean nothing. An index that
  // has the key under the true number would let nobody write that: it is made anew before.
  void RestoreNumbers() {
    for (const std::int64_t id : ListDamagedKeyframeRows(connection_)) {
      for (int bit = 0; bit < 63; ++bit) {
        const std::int64_t other = id ^ (std::int64_t{1} << bit);
        if (IsKeyframeRowOf(connection_, id, other)) {
          Query update = connection_.Prepare("UPDATE OR IGNORE keyframes SET id = ? WHERE id = ?");
          repaired_ += update.Bind(other).Bind(id).Run() > 0 ? 1U : 0U;
          break;
        }
      }
    }
  }

  void RestoreKeys(const KeyedTable& table) {
    std::vector<std::int64_t> damaged = table.list_damaged(connection_);
    std::sort(damaged.begin(), damaged.end());
    if (damaged.empty()) {
      return;
    }
    for (const auto& [id, key] : KeysByIndex(connection_, table, damaged)) {
      if (table.is_under(connection_, id, key.first, key.second)) {
        connection_.Prepare(table.write_key).Bind(key.first).Bind(key.second).Bind(id).Run();
        ++repaired_;
      }
    }
  }

  // A damaged row, if it is one of them, is not the one that stays.
  void SettleTwinsOf(const KeyedTable& table) {
    for (const auto& [key, ids] : ListTwins(connection_, table)) {
      std::int64_t kept = ids.front();
      for (const std::int64_t id : std::span(ids).subspan(1)) {
        kept = &table == &kKeyframes ? SettleTwins(connection_, {kept, id, key.first}, author_)
                                     : SettleLines(table, key, kept, id);
        has_lost_history_ = has_lost_history_ || &table == &kKeyframes;
        ++repaired_;
      }
    }
  }

  std::int64_t SettleLines(const KeyedTable& table,
                           const RowKey& key,
                           std::int64_t older,
                           std::int64_t younger) {
    Query same = connection_.Prepare(table.checksums);
    same.Bind(older).Bind(younger);
    const bool is_same = same.Step() && same.Int() != 0;
    const bool keeps_older = table.is_under(connection_, older, key.first, key.second);
    connection_.Prepare(table.remove).Bind(keeps_older ? younger : older).Run();
    if (!is_same) {
      has_lost_history_ = true;
      AddEvent(connection_, {EventKind::kTablesRepaired, author_, StrCat("table ", table.name),
                             "of two different lines of one time the first that is whole stays"});
    }
    return keeps_older ? older : younger;
  }

  Connection& connection_;
  const std::string& author_;
  bool has_lost_history_ = false;
  std::uint32_t repaired_ = 0;
};

}  // namespace

std::uint32_t RepairKeys(Connection& connection, const std::string& author) {
  return KeyRepair(connection, author).Run();
}

Status CheckKeyedRows(Connection& connection) {
  for (const KeyedTable* table : {&kStates, &kPoseLines, &kKeyframes}) {
    if (!table->list_damaged(connection).empty()) {
      return {StatusCode::kInvalidData,
              StrCat("store: rows of table ", table->name, " are damaged")};
    }
    for (const auto& [key, ids] : ListTwins(connection, *table)) {
      const bool is_same =
          table == &kKeyframes &&
          std::all_of(ids.begin(), ids.end(), [&, first = ids.front()](std::int64_t id) {
            return IsSameKeyframe(connection, first, id);
          });
      if (!is_same) {
        return {StatusCode::kInvalidData,
                StrCat("store: table ", table->name, " has different rows under one key")};
      }
    }
  }
  return {};
}

}  // namespace atlas
