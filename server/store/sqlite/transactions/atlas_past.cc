#include "server/store/sqlite/transactions/atlas_past.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>

#include "server/store/backup_types.h"
#include "server/store/event_types.h"
#include "server/store/session_types.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/start_table.h"

namespace atlas {
namespace {

// Of revisions that are known to be the atlas's.
class Lines {
 public:
  void Note(std::uint64_t revision) {
    const auto [line, is_new] = lines_.try_emplace(LineOf(revision), Known{revision, revision});
    if (!is_new) {
      line->second.first = std::min(line->second.first, revision);
      line->second.last = std::max(line->second.last, revision);
    }
  }
  // The first one of its line.
  void NoteBegin(std::uint64_t revision) {
    Note(revision);
    lines_.at(LineOf(revision)).has_begin = true;
  }

  std::vector<LostRevisions> Lost() const {
    std::vector<LostRevisions> lost;
    for (auto before = lines_.begin(), next = std::next(before); next != lines_.end();
         before = next++) {
      const bool is_exact = next->second.has_begin && next->first == before->first + 1;
      const std::uint64_t begin = next->second.first;
      lost.push_back({is_exact ? begin - kRevisionsLeftOut - 1 : before->second.last, begin});
    }
    return lost;
  }

 private:
  struct Known {
    std::uint64_t first = 0;
    std::uint64_t last = 0;
    bool has_begin = false;
  };

  std::map<std::uint64_t, Known> lines_{{0, {}}};
};

// A purged session keeps its row and a line of its history.
bool HasPurgedSession(Connection& connection) {
  static_assert(static_cast<int>(SessionState::kPurged) == 5);
  return connection.Ask(
             "SELECT EXISTS (SELECT 1 FROM sessions NOT INDEXED WHERE state = 5) "
             "OR EXISTS (SELECT 1 FROM session_states NOT INDEXED WHERE state = 5)") != 0;
}

}  // namespace

AtlasPast ReadPast(Connection& connection) {
  AtlasPast past;
  Lines lines;
  past.may_have_purged = HasPurgedSession(connection);
  ScanEvents(connection, [&](const Event& event) {
    const bool is_begin =
        event.kind == EventKind::kBackupRestored || event.kind == EventKind::kLogDamaged;
    if (event.is_damaged || event.kind == EventKind::kSessionPurged) {
      past.may_have_purged = true;
    }
    if (event.is_damaged) {
      return;
    }
    if (is_begin) {
      lines.NoteBegin(event.revision);
    } else {
      lines.Note(event.revision);
    }
  });
  for (const AtlasStart& start : ReadStarts(connection)) {
    lines.Note(start.revision);
  }
  lines.Note(ReadCounter(connection, Counter::kRevision));
  past.lost = lines.Lost();
  return past;
}

}  // namespace atlas
