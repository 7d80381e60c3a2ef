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
  const Status status = UploadAll(link);
  if (!IsAllAcknowledged() || !IsTemporary(status.code())) return status;
  report_.sessions_unknown = status;
  return {};
}

Status LastingUpload::UploadAll(AtlasLink& link) {
  acknowledged_ = options_.now();
  Result<AtlasClient*> client = link.Wait(options_.patience);
  while (client) {
    const std::uint64_t before = acknowledgements_;
    Status status = RunOn(**client);
    if (status.ok()) status = ReadSessions(**client);
    if (status.ok()) return status;
    if (!(*client)->is_broken()) return Refused(status);
    if (acknowledgements_ > before) link.Report({});  // it worked: the next attempt is a first one
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
  const auto lost_for = std::chrono::duration_cast<milliseconds>(options_.now() - acknowledged_);
  Result<AtlasClient*> client =
      lost_for < options_.patience ? link.Wait(options_.patience - lost_for) : Error(why);
  if (!client) return Error(GivenUp(why, client.error()));
  ++report_.reconnections;
  return client;
}

Status LastingUpload::GivenUp(const Status& broke, const Status& failure) const {
  const auto lost_for =
      std::chrono::duration_cast<std::chrono::seconds>(options_.now() - acknowledged_);
  const bool may_pass = IsTemporary(failure.code()) && !IsAllAcknowledged();
  const std::string where = IsAllAcknowledged() ? "all keyframes were acknowledged; their sessions"
                                                : StrCat("keyframe ", planned_[next_].key);
  return {
      failure.code(),
      StrCat(where, ": the connection broke (", broke.message(), "), and ", lost_for.count(),
             " s after the ", acknowledgements_ > 0 ? "last acknowledgement" : "beginning", ": ",
             failure.message(),
             may_pass ? "; the same command goes on there once the daemon can be reached" : "")};
}

Status LastingUpload::RunOn(AtlasClient& client) {
  ATLAS_RETURN_IF_ERROR(FindStart(client));
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
  NoteAnswers(uploader);
  report_.totals.Add(uploader.totals());
  return status;
}

void LastingUpload::NoteAnswers(const KeyframeUploader& uploader) {
  acknowledgements_ += uploader.totals().acked;
  if (uploader.totals().acked > 0) acknowledged_ = uploader.taken();
}

Status LastingUpload::FindStart(AtlasClient& client) {
  if (epoch_ != client.atlas().epoch) {
    epoch_ = client.atlas().epoch;
    is_started_ = false;
    compared_.clear();
    next_ = there_ = 0;
  }
  if (is_started_) return {};
  if (!planned_.empty()) {
    const auto sessions = client.ListSessions(planned_.front().key.session.vehicle);
    if (!sessions) return sessions.error();
    ATLAS_RETURN_IF_ERROR(Compare(client, *sessions));
    there_ = CountSentBefore(planned_, *sessions);
    next_ = there_ - std::min(there_, kSentTwice);
  }
  report_.sent_before = left_out_ = std::min<std::uint64_t>(left_out_, next_);
  is_started_ = true;
  return {};
}

Status LastingUpload::Compare(AtlasClient& client, std::span<const SessionSummary> sessions) {
  std::vector<std::size_t> open = FindThere(planned_, sessions);
  std::erase_if(open, [this](std::size_t i) { return compared_.contains(i); });
  KeyframeUploader uploader(client, options_);
  Status status;
  for (auto i = open.begin(); i != open.end() && status.ok(); ++i) {
    status = SendOne(*i, uploader);
  }
  if (status.ok()) status = uploader.Finish();
  NoteAnswers(uploader);
  // Of what is counted as acknowledged these are not, for they are sent again.
  report_.totals.sent += uploader.totals().sent;
  report_.totals.bytes_sent += uploader.totals().bytes_sent;
  const auto answered = static_cast<std::ptrdiff_t>(uploader.first_open());
  compared_.insert(open.begin(), open.begin() + answered);
  return status;
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
    ATLAS_RETURN_IF_ERROR(SendOne(i, uploader));
    if (progress_) progress_(i + 1, planned_.size());
  }
  return uploader.Finish();
}

// Hears what was answered meanwhile first: once sending fails nothing is heard any more, and it
// would be sent again.
Status LastingUpload::SendOne(std::size_t i, KeyframeUploader& uploader) {
  const Result<bool> is_answered = uploader.FinishUntil(Clock::now());
  if (!is_answered) return is_answered.error();
  return send_(i, uploader);
}

}  // namespace atlas
