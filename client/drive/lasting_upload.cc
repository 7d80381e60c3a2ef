#include "client/drive/lasting_upload.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {

using std::chrono::milliseconds;

LastingUpload::LastingUpload(std::vector<PlannedKeyframe> planned,
                             const UploadOptions& options,
                             Send send,
                             Progress progress)
    : planned_(std::move(planned)),
      options_(options),
      send_(std::move(send)),
      progress_(std::move(progress)) {}

Status LastingUpload::Run(AtlasLink& link) {
  acknowledged_ = Clock::now();
  Result<AtlasClient*> client = link.Wait(options_.patience);
  while (client) {
    const std::uint64_t acked_before = report_.totals.acked;
    Status status = RunOn(**client);
    if (status.ok()) status = ReadSessions(**client);
    if (status.ok()) return status;
    if (!(*client)->is_broken()) return Refused(status);
    if (report_.totals.acked > acked_before) {
      link.Report({});  // it worked: the next attempt is a first one
    }
    link.Report(status);
    client = Reconnect(link, status);
  }
  return client.error();
}

// The sessions as they are afterwards: what is in them besides, and whether they are in the map.
Status LastingUpload::ReadSessions(AtlasClient& client) {
  if (planned_.empty()) return {};
  auto sessions = client.ListSessions(planned_.front().key.session.vehicle);
  if (!sessions) return sessions.error();
  report_.sessions.clear();
  std::map<SessionKey, std::uint64_t> planned;
  for (const PlannedKeyframe& keyframe : planned_) {
    ++planned[keyframe.key.session];
  }
  for (SessionSummary& session : *sessions) {
    const auto ours = planned.find(session.key);
    if (ours == planned.end()) continue;
    const std::uint64_t there = session.keyframes + session.compacted;
    const std::uint64_t others = there - std::min(there, ours->second);
    report_.sessions.push_back({std::move(session), others});
  }
  return {};
}

Status LastingUpload::Refused(const Status& status) const {
  const std::uint64_t stored = report_.totals.acked - report_.totals.duplicates;
  if (stored == 0) return status;
  return {status.code(),
          StrCat(status.message(), "; before it ", stored, " keyframes of this run were stored")};
}

Result<AtlasClient*> LastingUpload::Reconnect(AtlasLink& link, const Status& why) {
  const auto lost_for = std::chrono::duration_cast<milliseconds>(Clock::now() - acknowledged_);
  Result<AtlasClient*> client =
      lost_for < options_.patience ? link.Wait(options_.patience - lost_for) : Error(why);
  if (!client) return Error(GivenUp(why, client.error()));
  ++report_.reconnections;
  return client;
}

Status LastingUpload::GivenUp(const Status& broke, const Status& failure) const {
  const auto lost_for =
      std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - acknowledged_);
  const bool may_pass = IsTemporary(failure.code());
  const std::string where = next_ < planned_.size()
                                ? StrCat("keyframe ", planned_[next_].key)
                                : "all keyframes were acknowledged; their sessions";
  return {
      failure.code(),
      StrCat(where, ": the connection broke (", broke.message(), "), and ", lost_for.count(),
             " s after the ", report_.totals.acked > 0 ? "last acknowledgement" : "beginning", ": ",
             failure.message(),
             may_pass ? "; the same command goes on there once the daemon can be reached" : "")};
}

Status LastingUpload::RunOn(AtlasClient& client) {
  if (epoch_ != client.atlas().epoch) ATLAS_RETURN_IF_ERROR(FindStart(client));
  KeyframeUploader uploader(client, options_);
  Status status = SendAll(uploader);
  // It is either there or refused when this returns.
  if (!status.ok() && !client.is_broken()) {
    const Status finished = uploader.Finish();
    if (!finished.ok() && finished.code() != status.code()) {
      status = Status(status.code(), status.message() + "; and " + finished.message());
    }
  }
  next_ += uploader.first_open();
  if (uploader.totals().acked > 0) acknowledged_ = uploader.taken();
  report_.totals.Add(uploader.totals());
  return status;
}

Status LastingUpload::FindStart(AtlasClient& client) {
  next_ = there_ = 0;
  if (!planned_.empty()) {
    const auto sessions = client.ListSessions(planned_.front().key.session.vehicle);
    if (!sessions) return sessions.error();
    ATLAS_RETURN_IF_ERROR(Compare(client, *sessions));
    there_ = CountSentBefore(planned_, *sessions);
    next_ = there_ - std::min(there_, kSentTwice);
  }
  if (!epoch_) report_.sent_before = next_;
  epoch_ = client.atlas().epoch;
  return {};
}

Status LastingUpload::Compare(AtlasClient& client, std::span<const SessionSummary> sessions) {
  KeyframeUploader uploader(client, options_);
  for (const std::size_t i : FindThere(planned_, sessions)) {
    ATLAS_RETURN_IF_ERROR(send_(i, uploader));
  }
  return uploader.Finish();
}

Status LastingUpload::SendAll(KeyframeUploader& uploader) {
  std::map<SessionKey, std::size_t> sent;
  for (std::size_t i = next_; i < planned_.size(); ++i) {
    // Those that are there, and the first ones of each session, say whether it is ours at all: new
    // ones follow when they are known to be. The very first alone: of two drives that are sent at
    // the same time under one name it is one's.
    std::size_t& of_session = sent[planned_[i].key.session];
    if (i == there_ || of_session == 1 || of_session == kSentTwice) {
      ATLAS_RETURN_IF_ERROR(uploader.Finish());
    }
    ++of_session;
    ATLAS_RETURN_IF_ERROR(send_(i, uploader));
    if (progress_) progress_(i + 1, planned_.size());
  }
  return uploader.Finish();
}

}  // namespace atlas
