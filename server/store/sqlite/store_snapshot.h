// One state of an atlas file, the daemon's database or a copy of it, read for as long as this
// lives, with or without a daemon that goes on writing to it. Neither the file nor its log is ever
// written or made. Owned and used by one thread at a time.
//
// All reads are of one transaction, so that tiles of different revisions never mix. Until it ends,
// a running daemon's log grows by what the daemon writes.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "core/base/status.h"
#include "server/store/keyframe_content.h"
#include "server/store/sqlite/database_files.h"
#include "server/store/store_types.h"

namespace atlas {

class Connection;
class Snapshot;

class StoreSnapshot {
 public:
  // kNotFound: there is no such file. kInvalidArgument: a directory, or no file. kInvalidData: not
  // an atlas, or damaged. kUnsupported: of another schema version. kPermissionDenied: unreadable,
  // or with a log that cannot be read where it lies; the message says what to do. kUnavailable: the
  // disk fails, or a daemon began to write to it meanwhile.
  static Result<StoreSnapshot> Open(const std::filesystem::path& file);

  StoreSnapshot(const StoreSnapshot&) = delete;
  StoreSnapshot& operator=(const StoreSnapshot&) = delete;
  StoreSnapshot(StoreSnapshot&&) noexcept;
  StoreSnapshot& operator=(StoreSnapshot&&) noexcept;
  ~StoreSnapshot();

  const StoreIdentity& identity() const { return identity_; }
  // The revision, and what was not fused then.
  const DirtyState& state() const { return state_; }

  // nullopt: there is no such tile. kInvalidData names a damaged one, others are good all the same.
  // kUnavailable as in Open.
  Result<std::optional<StoredTile>> ReadTile(const TileId& id);
  // Calls `visit` for every tile in the rectangle, in key order; it may read tiles, and not scan.
  // A failing visit ends it with its status; else errors as of ReadTile.
  Status ScanTiles(const TileRect& rect, const std::function<Status(const TileSummary&)>& visit);

  // Behind `after`, up to `limit`, with the revisions at which they changed last; damaged ones say
  // so. Errors as of ReadTile.
  Result<SessionPage> ListSessions(const SessionKey& after, std::uint32_t limit);
  // AtlasStore::ReadKeyframes. Errors as there, and kUnavailable as in Open.
  Result<KeyframeContents> ReadKeyframes(const SessionKey& session,
                                         std::optional<std::uint32_t> after_sequence,
                                         std::size_t max_bytes);

 private:
  // What `read` finds, unless somebody wrote meanwhile.
  template <typename T, typename Reading>
  Result<T> Read(const Reading& read);
  explicit StoreSnapshot(DatabaseFiles files);

  Status Begin();
  Status CheckUntouched() const;
  Status Explained(const Status& status) const;

  DatabaseFiles files_;
  std::unique_ptr<Connection> connection_;
  std::unique_ptr<Snapshot> snapshot_;  // ends before its connection
  StoreIdentity identity_;
  DirtyState state_;
};

}  // namespace atlas
