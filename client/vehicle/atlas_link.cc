#include "client/vehicle/atlas_link.h"

#include <algorithm>
#include <memory>
#include <random>
#include <thread>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {

using std::chrono::milliseconds;

namespace {

constexpr int kMaxDoublings = 20;

}  // namespace

LinkEnvironment LinkEnvironment::Real() {
  const auto engine = std::make_shared<std::mt19937_64>(std::random_device()());
  return {[] { return Clock::now(); }, [](milliseconds time) { std::this_thread::sleep_for(time); },
          [engine] { return std::uniform_real_distribution<double>(0.0, 1.0)(*engine); },
          [](const ConnectionOptions& options) {
            const auto attempt = std::make_shared<ConnectAttempt>(options);
            return [attempt](milliseconds time) {
              return attempt->Continue(time);
            };
          }};
}

AtlasLink::AtlasLink(LinkOptions options, LinkEnvironment environment)
    : options_(std::move(options)), environment_(std::move(environment)) {
  // One for all attempts: an answer that comes late is the next one's, and nothing is asked twice.
  auto& names = options_.connection.names;
  if (names == nullptr) names = std::make_shared<NameLookup>();
}

Status AtlasLink::CheckAtlas(const AtlasClient& client) {
  if (options_.atlas_id.empty()) options_.atlas_id = client.atlas().atlas_id;
  return options_.atlas_id == client.atlas().atlas_id
             ? Status()
             : Status(StatusCode::kConflict, "atlas link: the daemon serves another atlas");
}

Status AtlasLink::Continue(milliseconds timeout) {
  if (!attempt_) attempt_ = environment_.connect(options_.connection);
  ConnectProgress progress = attempt_(timeout);
  if (!progress.client && progress.failure.ok()) return {};
  attempt_ = nullptr;
  if (progress.client) {
    refusal_ = CheckAtlas(*progress.client);
    if (refusal_.ok()) client_ = std::move(progress.client);
    return refusal_;
  }
  if (progress.is_final) refusal_ = progress.failure;
  NoteFailure(progress.failure, progress.retry_after);
  return progress.failure;
}

void AtlasLink::NoteFailure(const Status& status, milliseconds retry_after) {
  last_failure_ = status;
  // Added, not the larger of both: else all that were refused together come back together.
  next_attempt_ = environment_.now() + retry_after + NextDelay(status.code());
}

milliseconds AtlasLink::NextDelay(StatusCode code) {
  const auto part = [](milliseconds most, double of_it) {
    return milliseconds(static_cast<std::int64_t>(of_it * static_cast<double>(most.count())));
  };
  if (code == StatusCode::kPermissionDenied) {
    return part(options_.denied_delay, 0.5 + 0.5 * environment_.random());
  }
  const std::int64_t doubled = options_.first_delay.count() << std::min(failures_++, kMaxDoublings);
  return part(std::min(milliseconds(doubled), options_.max_delay), environment_.random());
}

Result<AtlasClient*> AtlasLink::Client(milliseconds timeout) {
  if (client_) return &*client_;
  if (!refusal_.ok()) return Error(refusal_);
  if (!attempt_ && environment_.now() < next_attempt_) {
    return Error(StatusCode::kUnavailable,
                 "atlas link: waits before the next attempt; last: " + last_failure_.message());
  }
  if (Status status = Continue(timeout); !status.ok()) return Error(std::move(status));
  if (client_) return &*client_;
  return Error(StatusCode::kUnavailable,
               StrCat("atlas link: still connecting to ", options_.connection.endpoint.ToText()));
}

Result<AtlasClient*> AtlasLink::Wait(milliseconds timeout) {
  const Clock::time_point deadline = environment_.now() + timeout;
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - environment_.now());
    Result<AtlasClient*> client = Client(std::max(left, milliseconds(1)));
    if (client || attempt_ || !refusal_.ok()) return client;
    if (next_attempt_ >= deadline || environment_.now() >= deadline) return Error(last_failure_);
    const auto pause = std::chrono::ceil<milliseconds>(next_attempt_ - environment_.now());
    if (pause.count() > 0) environment_.sleep(pause);
  }
}

void AtlasLink::Report(const Status& status) {
  if (status.ok()) {
    failures_ = 0;
    return;
  }
  if (!client_ || !client_->is_broken()) return;
  const milliseconds retry_after = client_->retry_after();
  client_.reset();
  NoteFailure({StatusCode::kUnavailable, status.message()}, retry_after);
}

void AtlasLink::TryAgain() {
  refusal_ = Status();
  failures_ = 0;
  next_attempt_ = Clock::time_point::min();
}

}  // namespace atlas
