#include "server/store/sqlite/schema/table_order.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/stored_bytes.h"
#include "server/store/sqlite/schema/table_sums.h"

namespace atlas {
namespace {

using Numbers = std::vector<std::int64_t>;

struct NumberedTable {
  RowKind kind;
  const char* name;
  const char* number;  // its column
  const char* scan;    // all numbers, in the order in which they lie there
  const char* find;    // one
};

#define NUMBERED_TABLE(kind, name, number)                             \
  {                                                                    \
    kind, name, number, "SELECT " number " FROM " name " NOT INDEXED", \
        "SELECT 1 FROM " name " NOT INDEXED WHERE " number " = ?"      \
  }

constexpr NumberedTable kNumbered[] = {
    NUMBERED_TABLE(RowKind::kTile, "tiles", "key"),
    NUMBERED_TABLE(RowKind::kSession, "sessions", "id"),
    NUMBERED_TABLE(RowKind::kKeyframe, "keyframes", "id"),
    NUMBERED_TABLE(RowKind::kPose, "poses", "keyframe_id"),
    NUMBERED_TABLE(RowKind::kPoseHistory, "pose_history", "id"),
    NUMBERED_TABLE(RowKind::kPoseBatch, "pose_batches", "id"),
    NUMBERED_TABLE(RowKind::kDirtyTile, "dirty_tiles", "key"),
    NUMBERED_TABLE(RowKind::kSessionState, "session_states", "id"),
    NUMBERED_TABLE(RowKind::kCompaction, "compactions", "id"),
    NUMBERED_TABLE(RowKind::kStart, "starts", "number"),
    NUMBERED_TABLE(RowKind::kDamagedKeyframe, "damaged_keyframes", "keyframe_id"),
    NUMBERED_TABLE(RowKind::kEvent, "events", "id"),
    NUMBERED_TABLE(RowKind::kCounter, "counters", "id"),
};

#undef NUMBERED_TABLE

// Of two integers, and without numbers.
struct PairedTable {
  RowKind kind;
  const char* name;
  const char* scan;
  const char* intact;  // a condition
  const char* rows;    // itself, as an index
  const char* copy;    // an index that has all columns, if there is one
};

constexpr PairedTable kPaired[] = {
    {RowKind::kFootprint, "keyframe_tiles",
     "SELECT tile_key, keyframe_id FROM keyframe_tiles INDEXED BY "
     "sqlite_autoindex_keyframe_tiles_1",
     "checksum = row_hash(13, tile_key, keyframe_id, revision, is_current)",
     "sqlite_autoindex_keyframe_tiles_1", "changes_of_tile"},
    {RowKind::kTombstone, "tombstones",
     "SELECT session_id, sequence FROM tombstones INDEXED BY sqlite_autoindex_tombstones_1",
     "checksum = row_hash(10, session_id, sequence, time_ms, blob_bytes, blob_hash, "
     "compaction_id)",
     "sqlite_autoindex_tombstones_1", nullptr},
};

bool IsFound(Connection& connection, const NumberedTable& table, std::int64_t number) {
  Query row = connection.Prepare(table.find);
  row.Bind(number);
  return row.Step();
}

// Asked every some rows.
class Looks {
 public:
  explicit Looks(const std::function<Status()>& check_stop) : check_stop_(check_stop) {}

  Status Next() { return ++rows_ % kRowsBetween == 0 ? check_stop_() : Status(); }

 private:
  static constexpr std::uint64_t kRowsBetween = 1'024;

  const std::function<Status()>& check_stop_;
  std::uint64_t rows_ = 0;
};

Status Disorder(const char* table) {
  return {StatusCode::kInvalidData,
          StrCat("store: rows of table ", table, " are not found by their numbers")};
}

// kInvalidData: it is not.
Status CheckOrder(Connection& connection,
                  const NumberedTable& table,
                  const std::function<Status()>& check_stop) {
  Looks looks(check_stop);
  std::optional<std::int64_t> last;
  Query row = connection.Prepare(table.scan);
  while (row.Step()) {
    row.Rewind();
    const std::int64_t number = row.Int();
    if ((last && *last >= number) || !IsFound(connection, table, number)) {
      return Disorder(table.name);
    }
    last = number;
    ATLAS_RETURN_IF_ERROR(looks.Next());
  }
  return {};
}

Numbers ReadNumbers(Connection& connection, const NumberedTable& table) {
  Numbers numbers;
  Query row = connection.Prepare(table.scan);
  while (row.Step()) {
    row.Rewind();
    numbers.push_back(row.Int());
  }
  return numbers;
}

Status CheckOrder(Connection& connection,
                  const PairedTable& table,
                  const std::function<Status()>& check_stop) {
  Looks looks(check_stop);
  Query row = connection.Prepare(table.scan);
  std::optional<std::pair<std::int64_t, std::int64_t>> last;
  while (row.Step()) {
    row.Rewind();
    const std::int64_t first = row.Int();
    const std::pair key(first, row.Int());
    if (last && *last >= key) {
      return Disorder(table.name);
    }
    last = key;
    ATLAS_RETURN_IF_ERROR(looks.Next());
  }
  return {};
}

Status GoOn() {
  return {};
}

// The one between two others that is a bit away.
std::optional<std::int64_t> NumberBetween(std::int64_t before,
                                          std::int64_t number,
                                          std::int64_t behind) {
  for (int bit = 0; bit < 63; ++bit) {
    const std::int64_t other = number ^ (std::int64_t{1} << bit);
    if (before < other && other < behind) {
      return other;
    }
  }
  return std::nullopt;
}

// Rising, but for rows that are to be left out: they get the number of the one before.
void Order(Numbers& numbers) {
  constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kEnd = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::int64_t before = i == 0 ? kNone : numbers[i - 1];
    const std::int64_t behind = i + 1 < numbers.size() ? numbers[i + 1] : kEnd;
    // Of two in the wrong order it is the first, if the second goes with the one before.
    const bool fits = before < numbers[i] && (numbers[i] < behind || behind <= before);
    if (!fits) {
      numbers[i] =
          NumberBetween(before, numbers[i], behind <= before ? kEnd : behind).value_or(before);
    }
  }
}

std::string ReadText(Query row, const char* table) {
  row.Bind(std::string_view(table));
  return row.Step() ? row.Text() : std::string();
}

// Calls `copy` between the making of an empty table "rebuilt" and its taking the name. What a purge
// deletes later must not be in the pages that are free from then on.
template <typename Copy>
void Rebuild(Connection& connection, RowKind kind, const char* name, const Copy& copy) {
  connection.WriteDeferred();
  const OverwritingDeletions overwriting(connection);
  const std::string table = ReadText(
      connection.Prepare("SELECT sql FROM sqlite_master WHERE type = 'table' AND name = ?"), name);
  std::vector<std::string> indexes;
  {
    Query row = connection.Prepare(
        "SELECT sql FROM sqlite_master WHERE type = 'index' AND tbl_name = ? AND sql IS NOT NULL");
    row.Bind(std::string_view(name));
    while (row.Step()) {
      row.Rewind();
      indexes.push_back(row.Text());
    }
  }
  connection.Execute(StrCat("CREATE TABLE rebuilt ", table.substr(table.find('('))).c_str());
  copy();
  connection.Execute(StrCat("DROP TABLE ", name, "; ALTER TABLE rebuilt RENAME TO ", name).c_str());
  for (const std::string& index : indexes) {
    connection.Execute(index.c_str());
  }
  KeepTableSum(connection, kind);
  if (kind == RowKind::kSession) {
    KeepVehicleBytesOfChanges(connection);
  }
}

// How many rows were left out: those without a number of their own, and those that lack a value
// that each has to have.
std::size_t CopyNumbered(Connection& connection, const NumberedTable& table, Numbers numbers) {
  const std::size_t rows = numbers.size();
  const std::string columns = ReadText(
      connection.Prepare("SELECT group_concat(name) FROM pragma_table_info(?)"), table.name);
  const auto next = std::make_shared<std::size_t>(0);
  connection.AddFunction("next_number",
                         [next, kept = std::move(numbers)](std::span<const std::int64_t>) {
                           return kept.at((*next)++);
                         });
  const std::string others = columns.substr(columns.find(','));  // the number is the first
  connection.Execute(StrCat("INSERT OR IGNORE INTO rebuilt (", columns, ") SELECT next_number()",
                            others, " FROM ", table.name, " NOT INDEXED")
                         .c_str());
  return rows - static_cast<std::size_t>(connection.Ask("SELECT changes()"));
}

void CopyPaired(Connection& connection, const PairedTable& table) {
  for (const char* const index : {table.rows, table.copy}) {
    if (index != nullptr) {
      connection.Execute(StrCat("INSERT OR IGNORE INTO rebuilt SELECT * FROM ", table.name,
                                " INDEXED BY ", index, " WHERE ", table.intact)
                             .c_str());
    }
  }
}

// Rows that are damaged, and that an index has a copy of.
bool HasDamagedCopy(Connection& connection, const PairedTable& table) {
  return table.copy != nullptr &&
         connection.Ask(StrCat("SELECT EXISTS (SELECT 1 FROM ", table.name, " INDEXED BY ",
                               table.rows, " WHERE NOT (", table.intact, "))")
                            .c_str()) != 0;
}

OrderedTables GroupOf(RowKind kind) {
  switch (kind) {
    case RowKind::kCounter:
      return OrderedTables::kCounters;
    case RowKind::kTile:
      return OrderedTables::kTiles;
    case RowKind::kFootprint:
      return OrderedTables::kFootprints;
    default:
      return OrderedTables::kOthers;
  }
}

}  // namespace

void AddOrderChecks(const std::function<Status()>& check_stop,
                    std::vector<std::function<Status(Connection&)>>& checks) {
  const auto add = [&](const auto& tables) {
    for (const auto& table : tables) {
      checks.emplace_back([&table, check_stop](Connection& connection) {
        return CheckOrder(connection, table, check_stop);
      });
    }
  };
  add(kNumbered);
  add(kPaired);
}

std::vector<OrderedTable> PutTablesInOrder(Connection& connection,
                                           OrderedTables which,
                                           const KeyframeNumbers& keyframes) {
  std::vector<OrderedTable> rebuilt;
  for (const NumberedTable& table : kNumbered) {
    if (GroupOf(table.kind) == which && !CheckOrder(connection, table, GoOn).ok()) {
      Numbers numbers =
          table.kind == RowKind::kKeyframe ? keyframes(connection) : ReadNumbers(connection, table);
      Order(numbers);
      OrderedTable ordered{table.name, 0};
      Rebuild(connection, table.kind, table.name,
              [&] { ordered.left_out = CopyNumbered(connection, table, std::move(numbers)); });
      rebuilt.push_back(std::move(ordered));
    }
  }
  for (const PairedTable& table : kPaired) {
    if (GroupOf(table.kind) == which &&
        (!CheckOrder(connection, table, GoOn).ok() || HasDamagedCopy(connection, table))) {
      Rebuild(connection, table.kind, table.name, [&] { CopyPaired(connection, table); });
      rebuilt.push_back({table.name, 0});
    }
  }
  return rebuilt;
}

}  // namespace atlas
