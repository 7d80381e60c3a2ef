// The map that a command reads: a daemon's, or with --atlas that of a file.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "client/cli/command_line/command.h"
#include "client/connection/atlas_client.h"
#include "client/map/map_source.h"
#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

class AtlasFile;

class OpenedMap {
 public:
  // Errors as of AtlasClient::Connect or AtlasFile::Open. kInvalidArgument: an earlier revision of
  // a file. Says on `context.err` when tiles of a file wait to be fused.
  static Result<OpenedMap> Open(const CommandContext& context,
                                std::optional<std::uint64_t> at_revision = std::nullopt);

  // Lives as long as the map.
  MapSource& source() const { return *source_; }
  const MapProfile& profile() const { return source_->profile(); }
  // Of the atlas that it is of.
  const Bytes& atlas_id() const;
  // kNotFound where the map has no tile; the message says what to do. Else as of reading it.
  Status CheckHasTiles() const;
  // From a daemon; of a file nothing is received.
  std::uint64_t bytes_received() const;

 private:
  OpenedMap(std::unique_ptr<AtlasClient> client, std::unique_ptr<MapSource> source);
  explicit OpenedMap(std::unique_ptr<AtlasFile> file);

  std::unique_ptr<AtlasClient> client_;  // null: the source is a file
  std::unique_ptr<MapSource> source_;
  AtlasFile* file_ = nullptr;  // the source, if it is one
};

}  // namespace atlas
