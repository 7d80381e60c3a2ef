#include "tests/client/ledger/clean_atlas.h"

#include <chrono>
#include <optional>
#include <stdexcept>

#include "client/connection/atlas_client.h"
#include "client/connection/keyframe_uploader.h"
#include "tests/client/end_to_end/daemon_process.h"
#include "tests/client/ledger/fleet_frames.h"

namespace atlas::testing {
namespace {

void Expect(const Status& status) {
  if (!status.ok()) throw std::runtime_error("a clean atlas: " + status.message());
}

// What brings a session into this state that was uploaded; nullopt: nothing is to be asked for.
std::optional<SessionAction> ActionFor(SessionState state) {
  switch (state) {
    case SessionState::kRetracted:
      return SessionAction::kRetract;
    case SessionState::kReleased:
      return SessionAction::kRelease;
    default:
      return std::nullopt;
  }
}

}  // namespace

Bytes CleanDigest(const StoredAtlas& atlas,
                  const std::filesystem::path& data,
                  const std::vector<std::string>& daemon_flags) {
  const DaemonProcess daemon(data, daemon_flags);
  ConnectionOptions options;
  options.endpoint = {"127.0.0.1", daemon.port()};
  auto client = AtlasClient::Connect(options);
  if (!client) Expect(client.error());
  KeyframeUploader uploader(*client);
  for (auto entry = atlas.frames.rbegin(); entry != atlas.frames.rend(); ++entry) {
    const auto& [key, frame] = *entry;
    const Bytes blob = FleetBlob(key);
    Expect(uploader.Upload({key, frame.time_ms, frame.pose, blob}));
  }
  Expect(uploader.Finish());
  for (const auto& [key, state] : atlas.states) {
    const auto action = ActionFor(state);
    if (!action) continue;
    const auto changed = client->ChangeSession(key, *action, "");
    if (!changed) Expect(changed.error());
  }
  const auto digest = client->Digest(std::chrono::seconds(120));
  if (!digest) Expect(digest.error());
  return digest->sha256;
}

}  // namespace atlas::testing
