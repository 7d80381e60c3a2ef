// Uploads keyframes without waiting for each: a bounded window of them is on its way at any time,
// on the client's one connection, which other requests may share.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "client/connection/atlas_client.h"

namespace atlas {

class RpcChannel;

struct UploadOptions {
  std::size_t max_in_flight = 64;  // the daemon commits up to 64 at a time
  std::size_t max_in_flight_bytes = std::size_t{16} << 20;
  // Told of each keyframe once it is answered, in any order, also while another request of the
  // client waits. With it a refusal stops nothing.
  std::function<void(const KeyframeKey&, const Status&)> on_answer = {};
  // With a daemon that is busy (kUnavailable): what it refused is sent again, in the same order and
  // not before the daemon wants it, until it has taken nothing for so long. 0: not at all.
  std::chrono::milliseconds patience{0};
  // The clock that the patience goes by.
  std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
};

struct UploadTotals {
  std::uint64_t sent = 0;        // again and again, too
  std::uint64_t acked = 0;       // on disk, duplicates among them
  std::uint64_t duplicates = 0;  // were there already
  std::uint64_t tiles_marked = 0;
  std::uint64_t bytes_sent = 0;  // frames, as on the wire
  std::uint64_t revision = 0;    // of the newest acknowledgement

  void Add(const UploadTotals& more);
};

class KeyframeUploader {
 public:
  using Clock = std::chrono::steady_clock;

  // Without its client every call fails.
  explicit KeyframeUploader(const AtlasClient& client, const UploadOptions& options = {});
  KeyframeUploader(const KeyframeUploader&) = delete;  // the connection refers to it
  KeyframeUploader& operator=(const KeyframeUploader&) = delete;
  KeyframeUploader(KeyframeUploader&&) = delete;
  KeyframeUploader& operator=(KeyframeUploader&&) = delete;
  ~KeyframeUploader();

  // Sends; waits for an acknowledgement first when the window is full. A refusal of this or of an
  // earlier keyframe names that keyframe; its code is the daemon's (kConflict: other content under
  // the key). Sleeps only with patience.
  Status Upload(const KeyframeUpload& upload);
  // Waits for every acknowledgement. Returns the first refusal, after the others have been counted.
  Status Finish();
  // The same until `latest`, without patience. False: there was no room for it until then, and
  // nothing was taken. What was taken may still be on its way, and goes on in later calls.
  Result<bool> UploadUntil(const KeyframeUpload& upload, Clock::time_point latest);
  // False: some are not answered yet.
  Result<bool> FinishUntil(Clock::time_point latest);

  // Whether it is this client's connection that it uploads on.
  bool IsOf(const AtlasClient& client) const;
  std::size_t in_flight() const { return in_flight_.size(); }
  // The first that was not acknowledged, counted from 0 in the order of Upload: with it another
  // connection goes on.
  std::uint64_t first_open() const { return open_.empty() ? next_number_ : *open_.begin(); }
  const UploadTotals& totals() const { return totals_; }
  // When the daemon took one last, or the first was to be sent.
  Clock::time_point taken() const { return taken_; }

 private:
  struct Answer;  // a message
  struct InFlight {
    std::uint64_t number = 0;  // in the order of Upload
    std::uint64_t request_id = 0;
    KeyframeUpload upload;
    std::size_t size_bytes = 0;
    Bytes blob;  // with patience: what `upload` refers to
  };

  // False: no room at `latest`.
  Result<bool> AwaitRoom(std::size_t next_bytes, Clock::time_point latest);
  Status Transmit(InFlight upload, Clock::time_point latest);
  void NoteRefusal(InFlight upload, const Status& refusal);
  Status OnAnswer(const Answer& answer);
  // Until one more was answered; false when none was at `latest`. Link failures only; refusals are
  // remembered.
  Result<bool> HearOne(Clock::time_point latest);
  Status SendBusyAgain();
  bool IsFull(std::size_t next_bytes) const;
  Result<std::shared_ptr<RpcChannel>> Channel() const;

  std::weak_ptr<RpcChannel> channel_;
  Status takes_staged_;  // whether the daemon does
  UploadOptions options_;
  UploadTotals totals_;
  std::deque<InFlight> in_flight_;
  std::size_t in_flight_bytes_ = 0;
  std::vector<InFlight> busy_;  // refused, to be sent again
  std::uint64_t next_number_ = 0;
  std::set<std::uint64_t> open_;  // numbers that were not acknowledged
  Clock::time_point taken_;       // when the daemon took one last
  Status first_refusal_;
};

}  // namespace atlas
