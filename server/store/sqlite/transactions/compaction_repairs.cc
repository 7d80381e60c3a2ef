#include "server/store/sqlite/transactions/compaction_repairs.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/event_types.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/start_table.h"

namespace atlas {
namespace {

// More are no list of compactions, but a counter that says so.
constexpr std::int64_t kMostMissing = 1 << 20;

bool IsIntact(const StoredCompaction& stored) {
  return stored.fits && HashOf(stored.row) == stored.checksum;
}

// The row as it was, where one bit of its id turned, or what it dropped is what is left of it.
std::optional<CompactionRow> TellCompaction(const StoredCompaction& stored) {
  CompactionRow counted = stored.row;
  counted.dropped = stored.tombstones;
  counted.bytes = stored.tombstone_bytes;
  if (HashOf(counted) == stored.checksum) {
    return counted;
  }
  for (int bit = 0; bit < 63; ++bit) {
    CompactionRow other = stored.row;
    other.id ^= std::int64_t{1} << bit;
    if (HashOf(other) == stored.checksum) {
      return other;
    }
  }
  return std::nullopt;
}

class CompactionRepair {
 public:
  CompactionRepair(Connection& connection, const std::string& author)
      : connection_(connection),
        author_(author),
        last_(static_cast<std::int64_t>(ReadCounter(connection, Counter::kCompactions))),
        horizon_(ReadCounter(connection, Counter::kHistoryHorizon)) {}

  std::uint32_t Run() {
    connection_.Execute("REINDEX tombstones");
    DropDamagedTombstones();
    TakeRows();
    FillGaps();
    CountTombstones();
    return repaired_;
  }

 private:
  void DropDamagedTombstones() {
    const std::vector<TombstoneKey> damaged = ListDamagedTombstones(connection_);
    for (const TombstoneKey& key : damaged) {
      DeleteTombstone(connection_, key);
    }
    if (!damaged.empty()) {
      Note("tombstones", StrCat(damaged.size(),
                                " were damaged and are gone: keyframes that a compaction dropped "
                                "are stored anew if they are sent again"));
    }
    repaired_ += static_cast<std::uint32_t>(damaged.size());
  }

  // Those that are whole, and then what the others were, under ids that are free.
  void TakeRows() {
    std::vector<StoredCompaction> damaged;
    for (StoredCompaction& stored : ListCompactions(connection_)) {
      if (IsIntact(stored)) {
        last_ = std::max(last_, stored.row.id);
        rows_.emplace(stored.row.id, std::move(stored.row));
      } else {
        damaged.push_back(std::move(stored));
      }
    }
    for (const StoredCompaction& stored : damaged) {
      DeleteCompaction(connection_, stored.row.id);
      const auto told = TellCompaction(stored);
      CompactionRow row = told.value_or(stored.row);
      ++repaired_;
      if (row.id < 1 || row.id > last_ || rows_.contains(row.id)) {
        Note(StrCat("compaction ", stored.row.id), "its row was damaged, and is of none");
        continue;
      }
      if (!told) {
        row.author = kAtlasItself;
        row.revision = RevisionOf(row.id);
        Note(StrCat("compaction ", row.id), "its row was damaged: whose it was is lost");
      }
      WriteCompaction(connection_, row);
      rows_.emplace(row.id, std::move(row));
    }
  }

  // The next compaction gets the number behind that of how many there were.
  void FillGaps() {
    if (last_ - static_cast<std::int64_t>(rows_.size()) > kMostMissing) {
      return;
    }
    for (std::int64_t id = 1; id <= last_; ++id) {
      if (!rows_.contains(id)) {
        const CompactionRow row{id, RevisionOf(id), 0, kAtlasItself, 0, 0};
        WriteCompaction(connection_, row);
        rows_.emplace(id, row);
        Note(StrCat("compaction ", id), "its row was gone: whose it was is lost");
        ++repaired_;
      }
    }
  }

  void CountTombstones() {
    for (const StoredCompaction& stored : ListCompactions(connection_)) {
      CompactionRow row = stored.row;
      if (row.dropped == stored.tombstones && row.bytes == stored.tombstone_bytes) {
        continue;
      }
      row.dropped = stored.tombstones;
      row.bytes = stored.tombstone_bytes;
      DeleteCompaction(connection_, row.id);
      WriteCompaction(connection_, row);
      ++repaired_;
    }
  }

  // One that it may have been: that of the last one is the horizon.
  std::uint64_t RevisionOf(std::int64_t id) const {
    if (id == last_) {
      return horizon_;
    }
    const auto next = rows_.upper_bound(id);
    return next == rows_.end() ? horizon_ : next->second.revision;
  }

  void Note(const std::string& subject, const std::string& what) {
    AddEvent(connection_, {EventKind::kTablesRepaired, author_, subject, what});
  }

  Connection& connection_;
  const std::string& author_;
  std::int64_t last_;  // id
  const std::uint64_t horizon_;
  std::map<std::int64_t, CompactionRow> rows_;
  std::uint32_t repaired_ = 0;
};

}  // namespace

std::uint32_t RepairCompactions(Connection& connection, const std::string& author) {
  return CompactionRepair(connection, author).Run();
}

std::uint32_t RepairStarts(Connection& connection, const std::string& author) {
  const int dropped = DropUnknownStarts(connection);
  if (dropped > 0) {
    AddEvent(connection, {EventKind::kTablesRepaired, author, "starts",
                          StrCat("of ", dropped,
                                 " starts of the daemon nothing is known any more: surveys on disk "
                                 "from before are made anew")});
  }
  return static_cast<std::uint32_t>(dropped);
}

}  // namespace atlas
