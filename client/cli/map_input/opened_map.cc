#include "client/cli/map_input/opened_map.h"

#include <utility>

#include "client/atlas_file/atlas_file.h"
#include "client/cli/map_input/missing_map.h"
#include "client/map/daemon_source.h"

namespace atlas {
namespace {

void NoteDirtyTiles(const AtlasFile& file, const CommandContext& context) {
  if (file.dirty_tiles() == 0) return;
  context.err << "note: tiles of the file that wait to be fused: " << file.dirty_tiles()
              << "; they show what they showed before, until a daemon fuses them\n";
}

Result<std::unique_ptr<AtlasFile>> OpenFile(const CommandContext& context,
                                            const std::optional<std::uint64_t>& at_revision) {
  if (at_revision) {
    return Error(StatusCode::kInvalidArgument,
                 "--at with --atlas: a file has the tiles as they are, earlier ones are fused by a "
                 "daemon: run one on the file and ask it");
  }
  Result<AtlasFile> file = AtlasFile::Open(*context.atlas_file);
  if (!file) return Error(file.error());
  NoteDirtyTiles(*file, context);
  return std::make_unique<AtlasFile>(*std::move(file));
}

Status CheckDaemonsMap(AtlasClient& client) {
  const Result<AtlasStatus> status = client.ReadStatus();
  if (!status) return status.error();
  if (status->tiles > 0) return {};
  const auto sessions = client.ListSessions();
  if (!sessions) return sessions.error();
  return MissingMapStatus({status->dirty_tiles, *sessions, false});
}

Status CheckFilesMap(AtlasFile& file) {
  const Result<bool> has_tiles = file.HasTiles();
  if (!has_tiles) return has_tiles.error();
  if (*has_tiles) return {};
  const auto sessions = file.ListSessions();
  if (!sessions) return sessions.error();
  return MissingMapStatus({file.dirty_tiles(), *sessions, true});
}

}  // namespace

OpenedMap::OpenedMap(std::unique_ptr<AtlasClient> client, std::unique_ptr<MapSource> source)
    : client_(std::move(client)), source_(std::move(source)) {}

OpenedMap::OpenedMap(std::unique_ptr<AtlasFile> file) : file_(file.get()) {
  source_ = std::move(file);
}

Result<OpenedMap> OpenedMap::Open(const CommandContext& context,
                                  std::optional<std::uint64_t> at_revision) {
  if (context.atlas_file) {
    Result<std::unique_ptr<AtlasFile>> file = OpenFile(context, at_revision);
    if (!file) return Error(file.error());
    return OpenedMap(*std::move(file));
  }
  Result<AtlasClient> connected = context.Connect();
  if (!connected) return Error(connected.error());
  auto client = std::make_unique<AtlasClient>(*std::move(connected));
  auto source = std::make_unique<DaemonSource>(*client, at_revision);
  return OpenedMap(std::move(client), std::move(source));
}

const Bytes& OpenedMap::atlas_id() const {
  return file_ == nullptr ? client_->atlas().atlas_id : file_->key().atlas_id;
}

Status OpenedMap::CheckHasTiles() const {
  return file_ == nullptr ? CheckDaemonsMap(*client_) : CheckFilesMap(*file_);
}

std::uint64_t OpenedMap::bytes_received() const {
  return client_ == nullptr ? 0 : client_->bytes_received();
}

}  // namespace atlas
