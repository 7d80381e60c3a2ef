#include "client/merge/serve/watched_daemon.h"

#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

// How soon it stops while it connects.
constexpr milliseconds kSlice{200};
constexpr std::uint32_t kNeededMinor = 11;  // of the protocol: conditional batches

Status CheckTakesMerges(const AtlasIdentity& atlas) {
  if (atlas.protocol_minor < kNeededMinor) {
    return {StatusCode::kUnsupported, StrCat("the daemon speaks protocol 1.", atlas.protocol_minor,
                                             ", expected 1.", kNeededMinor, " or later")};
  }
  if (atlas.our_role != "merge" && atlas.our_role != "admin") {
    return {StatusCode::kPermissionDenied,
            StrCat("the daemon takes us for a ", atlas.our_role, ", expected role merge or admin")};
  }
  return {};
}

}  // namespace

WatchedDaemon::WatchedDaemon(LinkOptions link, const MergeServiceEnvironment& environment)
    : environment_(environment), link_(std::move(link)) {}

Result<AtlasClient*> WatchedDaemon::Wait(std::optional<Clock::time_point> latest) {
  while (refusal_.ok() && !environment_.is_stopping()) {
    auto client = link_.Client(kSlice);
    if (client) {
      refusal_ = CheckTakesMerges((*client)->atlas());
      if (!refusal_.ok()) break;
      is_told_lost_ = false;
      if (!std::exchange(is_told_connected_, true)) {
        environment_.on_event({.kind = MergeEventKind::kConnected});
      }
      return client;
    }
    refusal_ = link_.refusal();
    if (!refusal_.ok()) break;
    Lost(client.error());
    if (latest && environment_.now() >= *latest) {
      return Error(link_.last_failure().ok() ? client.error() : link_.last_failure());
    }
    environment_.sleep(kSlice);
  }
  if (!refusal_.ok()) return Error(refusal_);
  return Error(StatusCode::kUnavailable, "it is to stop");
}

bool WatchedDaemon::Report(const Status& status) {
  link_.Report(status);
  if (link_.is_connected()) return false;
  Lost(status);
  return true;
}

void WatchedDaemon::Lost(const Status& status) {
  is_told_connected_ = false;
  if (environment_.is_stopping()) return;
  if (std::exchange(is_told_lost_, true)) return;
  environment_.on_event({.kind = MergeEventKind::kLost, .status = status});
}

}  // namespace atlas
