// Keyframes in order to one daemon, over a link that may break in between and programs that may
// end: it goes on where it was.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "client/connection/keyframe_uploader.h"
#include "client/drive/sent_before.h"
#include "client/vehicle/atlas_link.h"
#include "core/base/status.h"

namespace atlas {

// A session that was uploaded to, as it is afterwards.
struct UploadedSession {
  SessionSummary summary;
  std::uint64_t others = 0;  // its keyframes beyond as many as were planned
};

struct LastingUploadReport {
  UploadTotals totals;
  std::uint64_t sent_before = 0;  // by an earlier run, and not again
  std::uint64_t reconnections = 0;
  std::vector<UploadedSession> sessions;
  // Not ok: all is acknowledged, and the link was lost for good before it was told what the
  // sessions are.
  Status sessions_unknown;
};

class LastingUpload {
 public:
  using Clock = std::chrono::steady_clock;
  // Makes the keyframe of that index and hands it to the uploader.
  using Send = std::function<Status(std::size_t, KeyframeUploader&)>;
  // How many were sent, of how many.
  using Progress = std::function<void(std::size_t, std::size_t)>;

  // `progress` may be empty. The options' patience is that with the link, too.
  LastingUpload(std::vector<PlannedKeyframe> planned,
                const UploadOptions& options,
                Send send,
                Progress progress);

  // Begins behind what an earlier run left there (CountSentBefore). A connection that breaks is
  // made again, and what was not acknowledged is sent again, until nothing was acknowledged for as
  // long as the patience; that is no failure once all was (sessions_unknown). Fails at the first
  // keyframe that the daemon refuses, naming it, with what was on its way waited for; of a session
  // that has other content under the last of its keys, or under the first ones that are sent
  // (kSentTwice), nothing else is on its way then, and under the very first, nothing at all.
  Status Run(AtlasLink& link);
  const LastingUploadReport& report() const { return report_; }

 private:
  Status UploadAll(AtlasLink& link);
  Status RunOn(AtlasClient& client);
  Status ReadSessions(AtlasClient& client);
  Status Refused(const Status& status) const;
  // Where to go on with this atlas: again, too, when it was restored from a backup meanwhile.
  Status FindStart(AtlasClient& client);
  // Sends those of which the daemon has the keys for certain: where it has other content under one,
  // that is another drive, of which nothing is to be stored. Over as many connections as it takes.
  Status Compare(AtlasClient& client, std::span<const SessionSummary> sessions);
  Status SendAll(KeyframeUploader& uploader);
  Status SendOne(std::size_t i, KeyframeUploader& uploader);
  void NoteAnswers(const KeyframeUploader& uploader);
  Result<AtlasClient*> Reconnect(AtlasLink& link, const Status& why);
  Status GivenUp(const Status& broke, const Status& failure) const;
  bool IsAllAcknowledged() const { return is_started_ && next_ == planned_.size(); }

  const std::vector<PlannedKeyframe> planned_;
  const UploadOptions options_;
  const Send send_;
  const Progress progress_;
  LastingUploadReport report_;
  std::optional<std::uint64_t> epoch_;   // of the atlas that the next four are about
  std::set<std::size_t> compared_;       // are there, and are ours
  bool is_started_ = false;              // all were compared
  std::size_t next_ = 0;                 // those before it are there
  std::size_t there_ = 0;                // and those before this one, as an earlier run left them
  std::uint64_t left_out_ = UINT64_MAX;  // of the first ones, in every epoch
  std::uint64_t acknowledgements_ = 0;   // those of compared ones, too
  Clock::time_point acknowledged_;       // the last one, or the beginning
};

}  // namespace atlas
