#include "client/cli/commands/merge/merge_sources.h"

#include <filesystem>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {

Result<std::unique_ptr<SessionSource>> OpenFileSessions(const std::string& file) {
  Result<AtlasFile> atlas = AtlasFile::Open(file);
  if (!atlas) return Error(atlas.error());
  return std::make_unique<FileSessions>(*std::move(atlas), file);
}

Result<std::unique_ptr<SessionSource>> OpenSessions(const std::string& from,
                                                    const CommandContext& context) {
  std::error_code error;
  if (std::filesystem::exists(from, error)) return OpenFileSessions(from);
  Result<Endpoint> endpoint = Endpoint::Parse(from);
  if (!endpoint) {
    return Error(StatusCode::kNotFound,
                 StrCat("--from ", from, ": there is no such file, and it is no HOST:PORT"));
  }
  ConnectionOptions options = context.connection;
  options.endpoint = *std::move(endpoint);
  Result<AtlasClient> client = AtlasClient::Connect(options);
  if (!client) return Error(client.error());
  return std::make_unique<ConnectedSessions>(std::make_unique<AtlasClient>(*std::move(client)),
                                             from);
}

}  // namespace atlas
