#include "tests/client/ledger/ledger_vehicle.h"

#include <algorithm>
#include <chrono>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas::testing {
namespace {

using std::chrono::milliseconds;

constexpr std::size_t kMaxUnanswered = 16;
constexpr std::size_t kMaxSpooled = 40;
constexpr std::uint32_t kFramesAtOnce = 3;
constexpr std::uint32_t kPosesAtOnce = 5;
constexpr std::size_t kLeastPurged = 8;
constexpr std::uint32_t kMaxPause_ms = 12;

Status Wrong(std::string what) {
  return {StatusCode::kInternal, std::move(what)};
}

bool IsOfTheLink(const Status& status) {
  return status.code() == StatusCode::kUnavailable || status.code() == StatusCode::kTimeout;
}

std::string Named(std::string_view word, const FrameId& frame) {
  return StrCat(word, ' ', frame.session, ' ', frame.sequence);
}

// As the protocol names it, of a session without a leap.
std::string_view StateAfter(SessionAction action) {
  switch (action) {
    case SessionAction::kRetract:
      return "retracted";
    case SessionAction::kRestore:
      return "live";
    case SessionAction::kRelease:
      return "released";
    case SessionAction::kPurge:
      return "purged";
    case SessionAction::kPublish:
      return "live";
  }
  return "";
}

}  // namespace

LedgerVehicle::LedgerVehicle(const LedgerVehicleOptions& options)
    : options_(options), ledger_(options.ledger), random_(options.seed) {
  if (options_.kind == VehicleKind::kSpool) {
    auto spool = UploadSpool::Open({.folder = options_.spool});
    if (!spool) throw std::runtime_error(spool.error().message());
    spool_ = *std::move(spool);
  }
  MakeLink();
}

void LedgerVehicle::MakeLink() {
  LinkOptions options;
  options.connection.endpoint = {"127.0.0.1", options_.port};
  options.connection.expected_profile = FleetProfile();
  if (options_.kind == VehicleKind::kResume) {
    resumed_session_ = NextFrame().session;
    options.connection.resume = FleetSession(options_.number, resumed_session_);
  }
  options.first_delay = milliseconds(20);
  options.max_delay = milliseconds(40);
  link_ = std::make_unique<AtlasLink>(std::move(options));
}

Status LedgerVehicle::Run() {
  while (true) {
    const bool was_connected = link_->is_connected();
    Status status = Step();
    if (!status.ok() && !IsOfTheLink(status)) {
      ledger_.Write(StrCat("wrong ", StatusCodeName(status.code()), ": ", status.message()));
      return status;
    }
    link_->Report(status);
    if (was_connected && !link_->is_connected()) ledger_.Write("lost");
    std::this_thread::sleep_for(milliseconds(Below(kMaxPause_ms)));
  }
}

Result<AtlasClient*> LedgerVehicle::Connected() {
  const bool is_other_session = NextFrame().session != resumed_session_;
  if (options_.kind == VehicleKind::kResume && is_other_session) {
    if (link_->is_connected()) ledger_.Write("lost");
    MakeLink();
  }
  const bool was_connected = link_->is_connected();
  Result<AtlasClient*> client = link_->Client(milliseconds(200));
  if (client && !was_connected) {
    ledger_.Write("connected");
    if (Status status = NoteHandshake(**client); !status.ok()) return Error(std::move(status));
  }
  return client;
}

// What is up to the last one is there: also what was sent and not answered.
Status LedgerVehicle::NoteHandshake(const AtlasClient& client) {
  if (options_.kind != VehicleKind::kResume) return {};
  const std::optional<std::uint32_t> last = client.atlas().last_sequence;
  const auto begin = state().frames.lower_bound({resumed_session_, 0});
  std::vector<FrameId> answered;
  for (auto entry = begin; entry != state().frames.end(); ++entry) {
    const bool is_there = last && entry->first.sequence <= *last;
    if (entry->second.is_acknowledged && !is_there) {
      return Wrong(Named("the handshake does not know", entry->first));
    }
    if (is_there && !entry->second.is_acknowledged) answered.push_back(entry->first);
  }
  for (const FrameId& frame : answered) {
    ledger_.Write(Named("uploaded", frame));
  }
  return {};
}

Status LedgerVehicle::Step() {
  const Result<AtlasClient*> client = Connected();
  if (!link_->refusal().ok()) return Wrong(link_->refusal().message());
  if (!client) return spool_ && IsOfTheLink(client.error()) ? Put() : client.error();
  switch (Below(8)) {
    case 0:
    case 1:
      return MovePoses(**client);
    case 2:
      return ChangeSession(**client);
    case 3:
      return spool_ ? Put() : UploadAgain(**client);
    default:
      return spool_ ? SendSpool(**client) : Upload(**client);
  }
}

KeyframeUpload LedgerVehicle::UploadOf(const FrameId& frame, ByteSpan blob) const {
  return {FleetKey(options_.number, frame), FleetTime(frame), FleetPose(options_.number, frame, 0),
          blob};
}

std::vector<FrameId> LedgerVehicle::Unanswered() const {
  std::vector<FrameId> frames;
  for (const auto& [id, frame] : state().frames) {
    if (!frame.is_acknowledged) frames.push_back(id);
  }
  return frames;
}

FrameId LedgerVehicle::NextFrame() const {
  if (state().frames.empty()) return {};
  FrameId next = state().frames.rbegin()->first;
  const bool is_over =
      ++next.sequence == kFramesOfASession || state().sessions.at(next.session).may_be_purged();
  // A resumed session ends when all of it was answered.
  const bool may_begin = options_.kind != VehicleKind::kResume || Unanswered().empty();
  return is_over && may_begin ? FrameId{next.session + 1, 0} : next;
}

Status LedgerVehicle::Upload(AtlasClient& client) {
  std::vector<FrameId> frames = Unanswered();
  const std::size_t unanswered = frames.size();
  FrameId next = NextFrame();
  for (auto left = 1 + Below(kFramesAtOnce); left > 0 && frames.size() < kMaxUnanswered; --left) {
    if (next.sequence == kFramesOfASession) break;
    frames.push_back(next);
    ++next.sequence;
  }
  // Behind what the handshake said nothing was there.
  return SendFrames(client, frames, options_.kind == VehicleKind::kResume ? 0 : unanswered);
}

Status LedgerVehicle::UploadAgain(AtlasClient& client) {
  for (const auto& [number, session] : state().sessions) {
    if (session.done == SessionAction::kPurge && Below(2) == 0) {
      return UploadPurged(client, number);
    }
  }
  const std::optional<FrameId> frame = DrawAcknowledged();
  if (!frame || options_.kind == VehicleKind::kResume) return Upload(client);
  const Bytes blob = FleetBlob(FleetKey(options_.number, *frame));
  KeyframeUploader uploader(client);
  Status status = uploader.Upload(UploadOf(*frame, blob));
  if (status.ok()) status = uploader.Finish();
  if (!status.ok() || uploader.totals().duplicates == 1) return status;
  return Wrong(Named("acknowledged, sent again and taken for new:", *frame));
}

// The name of a purged session takes nothing any more.
Status LedgerVehicle::UploadPurged(AtlasClient& client, std::uint32_t session) {
  const FrameId frame{session, 0};
  const Bytes blob = FleetBlob(FleetKey(options_.number, frame));
  KeyframeUploader uploader(client);
  Status status = uploader.Upload(UploadOf(frame, blob));
  if (status.ok()) status = uploader.Finish();
  if (status.code() == StatusCode::kConflict) return {};
  return status.ok() ? Wrong(Named("purged, sent again and taken:", frame)) : status;
}

Status LedgerVehicle::SendFrames(AtlasClient& client,
                                 const std::vector<FrameId>& frames,
                                 std::size_t may_be_duplicates) {
  Status refusal;
  UploadOptions options;
  options.on_answer = [&](const KeyframeKey& key, const Status& answer) {
    const auto session = static_cast<std::uint32_t>(std::stoul(key.session.session.substr(1)));
    if (answer.ok()) ledger_.Write(Named("uploaded", {session, key.sequence}));
    if (refusal.ok()) refusal = answer;
  };
  KeyframeUploader uploader(client, options);
  for (const FrameId& frame : frames) {
    ledger_.Write(Named("upload", frame));
    const Bytes blob = FleetBlob(FleetKey(options_.number, frame));
    ATLAS_RETURN_IF_ERROR(uploader.Upload(UploadOf(frame, blob)));
  }
  ATLAS_RETURN_IF_ERROR(uploader.Finish());
  ATLAS_RETURN_IF_ERROR(refusal);
  if (uploader.totals().duplicates <= may_be_duplicates) return {};
  return Wrong(Named("new, and taken for a duplicate: up to", frames.back()));
}

Status LedgerVehicle::Put() {
  if (spool_->waiting() >= kMaxSpooled) return {};
  const FrameId frame = NextFrame();
  const Bytes blob = FleetBlob(FleetKey(options_.number, frame));
  ledger_.Write(Named("put", frame));
  ATLAS_RETURN_IF_ERROR(spool_->Put(UploadOf(frame, blob)));
  ledger_.Write(Named("taken", frame));
  return {};
}

Status LedgerVehicle::SendSpool(AtlasClient& client) {
  for (auto left = 1 + Below(kFramesAtOnce); left > 0; --left) {
    ATLAS_RETURN_IF_ERROR(Put());
  }
  ledger_.Write("send");
  const Result<SpoolReport> report = spool_->Send(client, {.deadline = std::chrono::minutes(2)});
  if (!report) return report.error();
  if (report->retry_after.count() > 0) return {StatusCode::kUnavailable, "left alone"};
  const auto failed = report->set_aside + report->skipped + report->vanished;
  if (failed > 0 || spool_->waiting() > 0) return Wrong("spool: " + report->problem.message());
  ledger_.Write("sent");
  return {};
}

std::optional<FrameId> LedgerVehicle::DrawAcknowledged() {
  if (state().frames.empty()) return std::nullopt;
  const std::uint32_t sessions = state().frames.rbegin()->first.session + 1;
  const FrameId drawn{Below(sessions), Below(kFramesOfASession)};
  if (!IsAcknowledged(drawn) || state().sessions.at(drawn.session).may_be_purged()) {
    return std::nullopt;
  }
  return drawn;
}

bool LedgerVehicle::IsAcknowledged(const FrameId& frame) const {
  const auto found = state().frames.find(frame);
  return found != state().frames.end() && found->second.is_acknowledged;
}

bool LedgerVehicle::AreAcknowledged(std::uint32_t session, std::size_t at_least) const {
  std::size_t sent = 0;
  for (const auto& [id, frame] : state().frames) {
    if (id.session != session) continue;
    if (!frame.is_acknowledged) return false;
    ++sent;
  }
  return sent >= at_least;
}

// A batch that the link failed at comes again, or is given up: then it happened, or not.
Status LedgerVehicle::MovePoses(AtlasClient& client) {
  const bool is_again = lost_version_ && Below(2) == 0;
  const auto& batches = state().batches;
  std::set<FrameId> frames;
  std::uint32_t version = batches.empty() ? 1 : batches.rbegin()->first + 1;
  if (is_again) {
    version = *lost_version_;
    frames = {batches.at(version).frames.begin(), batches.at(version).frames.end()};
  }
  for (auto left = 1 + Below(kPosesAtOnce); left > 0 && !is_again; --left) {
    if (const auto frame = DrawAcknowledged()) frames.insert(*frame);
  }
  if (frames.empty()) return {};
  std::vector<PoseCorrection> corrections;
  std::string line = StrCat("move ", version);
  for (const FrameId& frame : frames) {
    corrections.push_back(
        {FleetKey(options_.number, frame), FleetPose(options_.number, frame, version)});
    line += StrCat(' ', frame.session, ':', frame.sequence);
  }
  ledger_.Write(line);
  lost_version_ = version;
  const auto done = client.UpdatePoses(corrections, "fleet");
  if (!done) return done.error();
  ledger_.Write(StrCat("moved ", version));
  lost_version_.reset();
  if (done->updated == frames.size() || (is_again && done->updated == 0)) return {};
  return Wrong(StrCat("batch ", version, ": ", done->updated, " of ", frames.size(), " moved"));
}

// What was not answered is asked again, until it is.
Status LedgerVehicle::ChangeSession(AtlasClient& client) {
  for (const auto& [number, session] : state().sessions) {
    if (session.asked) return Change(client, number, *session.asked, true);
  }
  const auto frame = DrawAcknowledged();
  const auto action = frame ? DrawAction(frame->session) : std::nullopt;
  return action ? Change(client, frame->session, *action, false) : Status();
}

std::optional<SessionAction> LedgerVehicle::DrawAction(std::uint32_t session) {
  const auto done = state().sessions.at(session).done;
  if (options_.kind == VehicleKind::kLeap) {
    const bool is_in_quarantine = HasLeap(options_.number, session) &&
                                  IsAcknowledged({session, kLeapSequence}) &&
                                  IsAcknowledged({session, kLeapSequence - 1});
    return is_in_quarantine && !done ? std::optional(SessionAction::kRelease) : std::nullopt;
  }
  if (done == SessionAction::kRetract) return SessionAction::kRestore;
  // Most sessions are in the map most of the time.
  if (Below(3) > 0) return std::nullopt;
  if (options_.kind != VehicleKind::kPurge) return SessionAction::kRetract;
  return AreAcknowledged(session, kLeastPurged) ? std::optional(SessionAction::kPurge)
                                                : std::nullopt;
}

Status LedgerVehicle::Change(AtlasClient& client,
                             std::uint32_t session,
                             SessionAction action,
                             bool is_again) {
  // What was to be moved may be gone.
  if (action == SessionAction::kPurge) lost_version_.reset();
  ledger_.Write(StrCat(WordOf(action), ' ', session));
  const auto done = client.ChangeSession(FleetSession(options_.number, session), action, "fleet");
  if (!done) return done.error();
  ledger_.Write(StrCat("changed ", session));
  if (done->state == StateAfter(action) && (is_again || done->is_changed)) return {};
  return Wrong(StrCat("session ", session, ": ", done->state, ", changed ", done->is_changed));
}

}  // namespace atlas::testing
