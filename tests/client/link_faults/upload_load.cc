#include "tests/client/link_faults/upload_load.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "client/vehicle/upload_spool.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::size_t kFramesAtOnce = 24;

KeyframeUpload UploadOf(const KeyframeKey& key, const FrameId& frame, int vehicle, ByteSpan blob) {
  return {key, FleetTime(frame), FleetPose(vehicle, frame, 0), blob};
}

bool IsOfTheLink(StatusCode code) {
  return code == StatusCode::kUnavailable || code == StatusCode::kTimeout;
}

// One client of the load, over as many connections as it takes.
class Uploading {
 public:
  explicit Uploading(const UploadLoad& load)
      : load_(load), left_(load.frames), end_(Clock::now() + load.patience) {}

  Result<UploadCount> Run(bool is_resuming) {
    Status failure;
    std::optional<AtlasLink> link;
    while (!left_.empty()) {
      if (Clock::now() >= end_) return Error(failure.WithContext("patience ended"));
      if (!link) link.emplace(OptionsFor(is_resuming));
      const bool was_connected = link->is_connected();
      const auto client = link->Wait(milliseconds(500));
      failure = client ? Status() : client.error();
      if (client && !was_connected && is_resuming) SkipWhatIsThere(**client);
      if (client && !left_.empty()) failure = SendSome(**client, is_resuming);
      if (!failure.ok() && !IsOfTheLink(failure.code())) return Error(failure);
      link->Report(failure);
      // Another session is named by another connection.
      if (is_resuming && (left_.empty() || left_.front().session != resumed_session_)) link.reset();
    }
    return count_;
  }

 private:
  LinkOptions OptionsFor(bool is_resuming) {
    LinkOptions options = HastyLink(load_.endpoint);
    resumed_session_ = left_.front().session;
    if (is_resuming) options.connection.resume = FleetSession(load_.vehicle, resumed_session_);
    return options;
  }

  void SkipWhatIsThere(const AtlasClient& client) {
    const auto last = client.atlas().last_sequence;
    std::erase_if(left_, [&](const FrameId& frame) {
      return last && frame.session == resumed_session_ && frame.sequence <= *last;
    });
  }

  Status SendSome(AtlasClient& client, bool is_resuming) {
    Status refusal;
    UploadOptions options;
    options.on_answer = [&](const KeyframeKey& key, const Status& answer) {
      if (refusal.ok()) refusal = answer;
      if (!answer.ok()) return;
      std::erase_if(left_,
                    [&](const FrameId& frame) { return FleetKey(load_.vehicle, frame) == key; });
    };
    KeyframeUploader uploader(client, options);
    Status status = SendFrames(uploader, is_resuming);
    if (status.ok()) status = uploader.Finish();
    count_.sent += uploader.totals().sent;
    count_.duplicates += uploader.totals().duplicates;
    return status.ok() ? refusal : status;
  }

  Status SendFrames(KeyframeUploader& uploader, bool is_resuming) const {
    const std::vector<FrameId> frames(
        left_.begin(),
        left_.begin() + static_cast<std::ptrdiff_t>(std::min(left_.size(), kFramesAtOnce)));
    for (const FrameId& frame : frames) {
      if (is_resuming && frame.session != resumed_session_) break;
      const KeyframeKey key = FleetKey(load_.vehicle, frame);
      const Bytes blob = FleetBlob(key);
      ATLAS_RETURN_IF_ERROR(uploader.Upload(UploadOf(key, frame, load_.vehicle, blob)));
    }
    return {};
  }

  const UploadLoad& load_;
  std::vector<FrameId> left_;
  Clock::time_point end_;
  std::uint32_t resumed_session_ = 0;  // that the link names
  UploadCount count_;
};

}  // namespace

LinkOptions HastyLink(const Endpoint& endpoint) {
  LinkOptions options;
  options.connection.endpoint = endpoint;
  options.connection.expected_profile = FleetProfile();
  options.connection.connect_timeout = milliseconds(250);
  options.connection.request_timeout = milliseconds(250);
  options.first_delay = milliseconds(10);
  options.max_delay = milliseconds(30);
  return options;
}

Result<UploadCount> UploadDirectly(const UploadLoad& load) {
  return Uploading(load).Run(false);
}

Result<UploadCount> UploadResuming(const UploadLoad& load) {
  return Uploading(load).Run(true);
}

Result<UploadCount> UploadThroughSpool(const UploadLoad& load,
                                       const std::filesystem::path& folder) {
  SpoolOptions options{.folder = folder};
  options.upload.max_in_flight = kFramesAtOnce;
  auto spool = UploadSpool::Open(options);
  if (!spool) return Error(spool.error());
  for (const FrameId& frame : load.frames) {
    const KeyframeKey key = FleetKey(load.vehicle, frame);
    const Bytes blob = FleetBlob(key);
    const Status put = spool->Put(UploadOf(key, frame, load.vehicle, blob));
    if (!put.ok()) return Error(put);
  }
  const Clock::time_point end = Clock::now() + load.patience;
  AtlasLink link(HastyLink(load.endpoint));
  while (spool->waiting() > 0) {
    if (Clock::now() >= end) return Error(StatusCode::kTimeout, "spool: patience ended");
    const auto client = link.Wait(milliseconds(500));
    if (!client && !IsOfTheLink(client.error().code())) return Error(client.error());
    if (!client) continue;
    const auto sent = spool->Send(**client);
    if (!sent && !IsOfTheLink(sent.error().code())) return Error(sent.error());
    link.Report(sent ? Status() : sent.error());
  }
  if (spool->refused() > 0) return Error(StatusCode::kInternal, "spool: some were refused");
  return UploadCount{};
}

}  // namespace atlas::testing
