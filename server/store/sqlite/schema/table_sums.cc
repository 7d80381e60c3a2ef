#include "server/store/sqlite/schema/table_sums.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

struct SummedTable {
  RowKind kind;
  const char* name;
  const char* checksums;  // of all its rows
};

constexpr SummedTable kTables[] = {
    {RowKind::kSession, "sessions", "SELECT checksum FROM sessions NOT INDEXED"},
    {RowKind::kKeyframe, "keyframes", "SELECT checksum FROM keyframes NOT INDEXED"},
    {RowKind::kPose, "poses", "SELECT checksum FROM poses NOT INDEXED"},
    {RowKind::kPoseHistory, "pose_history", "SELECT checksum FROM pose_history NOT INDEXED"},
    {RowKind::kPoseBatch, "pose_batches", "SELECT checksum FROM pose_batches NOT INDEXED"},
    {RowKind::kTile, "tiles", "SELECT checksum FROM tiles NOT INDEXED"},
    {RowKind::kSessionState, "session_states", "SELECT checksum FROM session_states NOT INDEXED"},
    {RowKind::kCompaction, "compactions", "SELECT checksum FROM compactions NOT INDEXED"},
    {RowKind::kTombstone, "tombstones", "SELECT checksum FROM tombstones NOT INDEXED"},
    {RowKind::kStart, "starts", "SELECT checksum FROM starts NOT INDEXED"},
    {RowKind::kCounter, "counters", "SELECT checksum FROM counters NOT INDEXED"},
    // Without rowids it is an index itself, and SQLite would take a smaller one that has all of it.
    {RowKind::kFootprint, "keyframe_tiles",
     "SELECT checksum FROM keyframe_tiles INDEXED BY sqlite_autoindex_keyframe_tiles_1"},
    {RowKind::kDirtyTile, "dirty_tiles", "SELECT checksum FROM dirty_tiles NOT INDEXED"},
    {RowKind::kEvent, "events", "SELECT checksum FROM events NOT INDEXED"},
    {RowKind::kDamagedKeyframe, "damaged_keyframes",
     "SELECT checksum FROM damaged_keyframes NOT INDEXED"},
};

struct TableSum {
  std::int64_t rows = 0;
  std::int64_t checksums = 0;

  bool operator==(const TableSum&) const = default;
};

// What the statements of a transaction change: by a statement a row it was a third of an upload.
class SumChanges final : public Deferred {
 public:
  void Note(RowKind table, std::int64_t rows, std::int64_t checksums) {
    TableSum& change = changes_[table];
    change.rows += rows;
    change.checksums ^= checksums;
  }
  const TableSum& of(RowKind table) { return changes_[table]; }
  void Set(RowKind table, const TableSum& change) { changes_[table] = change; }

  void Write(Connection& connection) override {
    for (auto& [table, change] : changes_) {
      if (change == TableSum()) {
        continue;
      }
      connection
          .Prepare(
              "UPDATE main.table_sums SET row_count = row_count + ?1, "
              "checksums = (checksums | ?2) - (checksums & ?2) WHERE id = ?3")
          .Bind(change.rows)
          .Bind(change.checksums)
          .Bind(static_cast<std::int64_t>(table))
          .Run();
      change = {};
    }
  }
  void Save() override { saved_ = changes_; }
  void Restore() override { changes_ = saved_; }
  void Forget() override { changes_.clear(); }

 private:
  std::map<RowKind, TableSum> changes_;
  std::map<RowKind, TableSum> saved_;
};

void WriteChanges(Connection& connection) {
  if (SumChanges* changes = connection.FindDeferred<SumChanges>()) {
    changes->Write(connection);
  }
}

TableSum AddUp(Connection& connection, const SummedTable& table) {
  Query row = connection.Prepare(table.checksums);
  TableSum sum;
  while (row.Step()) {
    row.Rewind();
    ++sum.rows;
    sum.checksums ^= row.Int();
  }
  return sum;
}

// Nothing if its row is not there.
std::optional<TableSum> ReadKept(Connection& connection, RowKind kind) {
  Query row = connection.Prepare("SELECT row_count, checksums FROM main.table_sums WHERE id = ?");
  row.Bind(static_cast<std::int64_t>(kind));
  return row.Step() ? std::optional(TableSum{row.Int(), row.Int()}) : std::nullopt;
}

Status Check(Connection& connection, const SummedTable& table) {
  WriteChanges(connection);
  const auto kept = ReadKept(connection, table.kind);
  if (!kept) {
    return Status(StatusCode::kInvalidData,
                  StrCat("store: what table ", table.name, " should hold is not known"));
  }
  const TableSum found = AddUp(connection, table);
  if (found == *kept) {
    return {};
  }
  return Status(StatusCode::kInvalidData,
                found.rows == kept->rows ? StrCat("store: rows of table ", table.name,
                                                  " are not those that were written")
                                         : StrCat("store: table ", table.name, " has ", found.rows,
                                                  " rows, and should have ", kept->rows));
}

void WriteKept(Connection& connection, const SummedTable& table, const TableSum& sum) {
  connection
      .Prepare(
          "INSERT INTO main.table_sums (id, name, row_count, checksums) VALUES (?,?,?,?) "
          "ON CONFLICT (id) DO UPDATE SET row_count = excluded.row_count, "
          "checksums = excluded.checksums")
      .Bind(static_cast<std::int64_t>(table.kind))
      .Bind(std::string_view(table.name))
      .Bind(sum.rows)
      .Bind(sum.checksums)
      .Run();
}

void Write(Connection& connection, const SummedTable& table) {
  WriteChanges(connection);
  WriteKept(connection, table, AddUp(connection, table));
}

const SummedTable& Find(RowKind kind) {
  return *std::find_if(std::begin(kTables), std::end(kTables),
                       [kind](const SummedTable& table) { return table.kind == kind; });
}

// Of the connection alone. SQLite has no XOR: a row that changes tells both checksums.
void AddTriggers(Connection& connection, const SummedTable& table) {
  const auto trigger = [&](const char* event, const char* rows, const char* checksums) {
    connection.Execute(StrCat("CREATE TEMP TRIGGER ", table.name, "_", std::string_view(event, 6),
                              " AFTER ", event, " ON main.", table.name, " BEGIN SELECT note_row(",
                              static_cast<int>(table.kind), ", ", rows, ", ", checksums, "); END")
                           .c_str());
  };
  trigger("INSERT", "1", "0, new.checksum");
  trigger("DELETE", "-1", "old.checksum, 0");
  trigger("UPDATE OF checksum", "0", "old.checksum, new.checksum");
}

}  // namespace

void WriteTableSums(Connection& connection) {
  for (const SummedTable& table : kTables) {
    Write(connection, table);
  }
}
void WriteTableSum(Connection& connection, RowKind table) {
  Write(connection, Find(table));
}

void WithoutCounting(Connection& connection, RowKind table, const std::function<void()>& restore) {
  SumChanges* const changes = connection.FindDeferred<SumChanges>();
  if (changes == nullptr) {
    restore();
    return;
  }
  const TableSum before = changes->of(table);
  restore();
  changes->Set(table, before);
}

// Triggers of the connection alone: what others delete is missed.
void KeepTableSums(Connection& connection) {
  SumChanges& changes = connection.Defer(std::make_unique<SumChanges>());
  connection.AddFunction(
      "note_row", [&connection, &changes](std::span<const std::int64_t> row) -> std::int64_t {
        if (!connection.is_in_transaction()) {
          throw std::logic_error("rows are written in transactions, which count them");
        }
        changes.Note(static_cast<RowKind>(row[0]), row[1], row[2] ^ row[3]);
        return 0;
      });
  for (const SummedTable& table : kTables) {
    AddTriggers(connection, table);
  }
}

void KeepTableSum(Connection& connection, RowKind table) {
  if (connection.FindDeferred<SumChanges>() != nullptr) {
    AddTriggers(connection, Find(table));
  }
}

std::uint64_t HashOfTableSums(Connection& connection) {
  Query row =
      connection.Prepare("SELECT id, row_count, checksums FROM main.table_sums ORDER BY id");
  ByteWriter out;
  while (row.Step()) {
    row.Rewind();
    for (int column = 0; column < 3; ++column) {
      out.I64(row.Int());
    }
  }
  return Hash64(out.bytes());
}

Status CheckTableSums(Connection& connection) {
  for (const SummedTable& table : kTables) {
    ATLAS_RETURN_IF_ERROR(Check(connection, table));
  }
  return {};
}

Status CheckTableSum(Connection& connection, RowKind table) {
  return Check(connection, Find(table));
}

}  // namespace atlas
