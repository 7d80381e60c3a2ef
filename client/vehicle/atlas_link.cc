#include "client/vehicle/atlas_link.h"

#include <algorithm>
#include <memory>
#include <random>
#include <thread>
#include <utility>

#include "client/vehicle/retry.h"

namespace atlas {

using std::chrono::milliseconds;

namespace {

constexpr int kMaxDoublings = 20;

}  // namespace

LinkEnvironment LinkEnvironment::Real() {
  const auto engine = std::make_shared<std::mt19937_64>(std::random_device()());
  return {[] { return Clock::now(); }, [](milliseconds time) { std::this_thread::sleep_for(time); },
          [engine] { return std::uniform_real_distribution<double>(0.0, 1.0)(*engine); },
          [](const ConnectionOptions& options, milliseconds& retry_after) {
            return AtlasClient::Connect(options, retry_after);
          }};
}

AtlasLink::AtlasLink(LinkOptions options, LinkEnvironment environment)
    : options_(std::move(options)), environment_(std::move(environment)) {}

Status AtlasLink::CheckAtlas(const AtlasClient& client) {
  if (options_.atlas_id.empty()) options_.atlas_id = client.atlas().atlas_id;
  return options_.atlas_id == client.atlas().atlas_id
             ? Status()
             : Status(StatusCode::kConflict, "atlas link: the daemon serves another atlas");
}

Status AtlasLink::Connect(milliseconds timeout) {
  ConnectionOptions connection = options_.connection;
  connection.connect_timeout = std::min(connection.connect_timeout, timeout);
  milliseconds retry_after{0};
  Result<AtlasClient> client = environment_.connect(connection, retry_after);
  Status status = client ? CheckAtlas(*client) : client.error();
  if (!status.ok()) {
    NoteFailure(status, retry_after);
    return status;
  }
  client_.emplace(*std::move(client));
  return {};
}

void AtlasLink::NoteFailure(const Status& status, milliseconds retry_after) {
  last_failure_ = status;
  if (!MaySucceedLater(status.code())) {
    refusal_ = status;
    return;
  }
  const double doubled = static_cast<double>(options_.first_delay.count()) *
                         static_cast<double>(1 << std::min(failures_, kMaxDoublings));
  const double most_ms = std::min(doubled, static_cast<double>(options_.max_delay.count()));
  const auto delay = milliseconds(static_cast<std::int64_t>(environment_.random() * most_ms));
  // Added, not the larger of both: else all that were refused together come back together.
  next_attempt_ = environment_.now() + retry_after + delay;
  ++failures_;
}

Result<AtlasClient*> AtlasLink::Client(milliseconds timeout) {
  if (client_) return &*client_;
  if (!refusal_.ok()) return Error(refusal_);
  if (environment_.now() < next_attempt_) {
    return Error(StatusCode::kUnavailable,
                 "atlas link: waits before the next attempt; last: " + last_failure_.message());
  }
  if (Status status = Connect(timeout); !status.ok()) return Error(std::move(status));
  return &*client_;
}

Result<AtlasClient*> AtlasLink::Wait(milliseconds timeout) {
  const Clock::time_point deadline = environment_.now() + timeout;
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - environment_.now());
    Result<AtlasClient*> client = Client(std::max(left, milliseconds(1)));
    if (client || !refusal_.ok()) return client;
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
  // After a broken frame nothing behind it can be read; other refusals leave the link as it is.
  const bool is_broken = status.code() == StatusCode::kUnavailable ||
                         status.code() == StatusCode::kTimeout ||
                         status.code() == StatusCode::kInvalidData;
  if (!is_broken || !client_) return;
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
