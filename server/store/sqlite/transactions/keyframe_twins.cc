#include "server/store/sqlite/transactions/keyframe_twins.h"

#include <exception>
#include <optional>
#include <set>
#include <vector>

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "server/store/event_types.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/tables/damaged_keyframe_table.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/keyframe_row.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/start_table.h"

namespace atlas {
namespace {

class Settlement {
 public:
  Settlement(Connection& connection, const KeyframeTwins& twins, const std::string& author)
      : connection_(connection), twins_(twins), author_(author) {}

  std::int64_t Run() {
    const auto older = ReadKeyframeRow(connection_, twins_.older);
    const auto younger = ReadKeyframeRow(connection_, twins_.younger);
    if (!younger) {
      Drop(twins_.younger, EventKind::kKeyframeGivenUp, younger.error().message());
      return twins_.older;
    }
    const std::uint64_t stored = Hash64(ReadBlobUnchecked(connection_, twins_.older));
    if (!older && stored != younger->blob_hash) {
      Drop(twins_.older, EventKind::kKeyframeGivenUp, older.error().message());
      return twins_.younger;
    }
    const bool is_same = !older || (older->blob_hash == younger->blob_hash &&
                                    older->record.time_ms == younger->record.time_ms);
    TakeCorrections();
    const auto sent = ReadUploadedKeyframe(connection_, twins_.younger);
    const bool is_damaged = !older || stored != older->blob_hash;
    Drop(twins_.younger, EventKind::kTablesRepaired,
         is_same ? "it was stored twice, as the index had lost it: what came first stays"
                 : "another one was stored under its key, as the index had lost it: what came "
                   "first stays");
    if (is_same && is_damaged && sent) {
      RestoreKeyframe(connection_, *sent, twins_.older, twins_.session_id, FirstRevision());
    }
    return twins_.older;
  }

 private:
  // For people.
  std::string NameOf(std::int64_t id) const {
    const auto row = ReadKeyframeRow(connection_, id);
    const auto session =
        row ? ReadSession(connection_, row->session_id) : Result<SessionRow>(Error(row.error()));
    return session ? StrCat("keyframe ", KeyframeKey{session->record.key, row->record.key.sequence})
                   : StrCat("keyframe number ", id);
  }

  // At which the older one was uploaded.
  std::uint64_t FirstRevision() const {
    for (const auto& line : ReadPoseHistory(connection_, twins_.older)) {
      if (line) {
        return line->revision;
      }
    }
    return 0;
  }

  // Those of batches, after which the younger one alone was found under the key.
  void TakeCorrections() {
    std::uint64_t last = 0;
    for (const auto& line : ReadPoseHistory(connection_, twins_.older)) {
      last = line ? line->revision : last;
    }
    bool is_moved = false;
    for (const auto& line : ReadPoseHistory(connection_, twins_.younger)) {
      if (line && line->batch != 0 && line->revision > last) {
        PoseChange taken = *line;
        taken.keyframe_id = twins_.older;
        WritePose(connection_, taken);
        is_moved = true;
      }
    }
    const auto footprint = is_moved ? FootprintOfYounger() : std::nullopt;
    if (footprint) {
      WriteFootprint(connection_, twins_.older, *footprint, LastChange(connection_, twins_.older));
    }
  }

  // None: it is damaged. Who checks keyframes finds that the older one lists other tiles than it
  // touches.
  std::optional<std::vector<TileId>> FootprintOfYounger() const {
    try {
      return ReadFootprint(connection_, twins_.younger);
    } catch (const std::exception& error) {
      if (StatusFromException(error).code() != StatusCode::kInvalidData) throw;
      return std::nullopt;
    }
  }

  void Drop(std::int64_t id, EventKind kind, const std::string& why) {
    const std::string name = NameOf(id);
    std::set<TileId> tiles;
    for (const std::int64_t twin : {twins_.older, twins_.younger}) {
      for (const TileId& tile : ReadFootprintUnchecked(connection_, twin)) {
        tiles.insert(tile);
      }
    }
    DeleteFootprint(connection_, id);
    DeletePoses(connection_, id);
    DeleteKeyframe(connection_, id);
    DeleteDamagedKeyframe(connection_, id);
    const std::uint64_t revision = NextRevision(connection_);
    for (const TileId& tile : tiles) {
      MarkTile(connection_, tile, revision, revision);
    }
    AddEvent(connection_, {kind, author_, name, StrCat(why, "; ", tiles.size(), " tiles")});
  }

  Connection& connection_;
  const KeyframeTwins twins_;
  const std::string& author_;
};

}  // namespace

std::int64_t SettleTwins(Connection& connection,
                         const KeyframeTwins& twins,
                         const std::string& author) {
  return Settlement(connection, twins, author).Run();
}

}  // namespace atlas
