// UploadSpool::Send: one run through the queue.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "client/vehicle/spooled_keyframe.h"
#include "client/vehicle/stored_file.h"
#include "client/vehicle/upload_spool.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

// The daemon fails at it and not at others: so often, and it is set aside.
constexpr int kMaxFailures = 3;
// At so many and at no other: the fault is the daemon's.
constexpr std::size_t kMaxFailed = 8;

// Not the keyframe is refused, but whoever sends it: but for the keyframe of another vehicle, which
// comes under the wrong name whenever it comes.
bool IsOfTheClient(StatusCode code, const KeyframeKey& key, const AtlasIdentity& atlas) {
  const bool is_of_another = atlas.our_role == "vehicle" && !atlas.our_name.empty() &&
                             atlas.our_name != key.session.vehicle;
  return code == StatusCode::kPermissionDenied && !is_of_another;
}

}  // namespace

// What was sent on a connection and is not dealt with: it outlives the Send, and stays where it is
// when the spool is moved. A round ends when all is answered.
struct UploadSpool::Underway {
  using Clock = std::chrono::steady_clock;

  Underway(const AtlasClient& client, UploadOptions options)
      : atlas(client.atlas()), uploader(client, WithoutPatience(std::move(options))) {}

  UploadOptions WithoutPatience(UploadOptions options) {
    options.patience = std::chrono::milliseconds(0);
    options.on_answer = [this](const KeyframeKey& key, const Status& answer) {
      answers.emplace_back(key, answer);
    };
    return options;
  }
  bool Has(Number number) const {
    const auto is_it = [number](const auto& entry) {
      return entry.second == number;
    };
    return std::any_of(in_flight.begin(), in_flight.end(), is_it) || failed.contains(number);
  }

  std::chrono::milliseconds denied_for() const {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(denied_until - Clock::now());
    return std::max(left, std::chrono::milliseconds(0));
  }

  const AtlasIdentity atlas;  // as it was when the client connected
  std::map<KeyframeKey, Number> in_flight;
  std::vector<std::pair<KeyframeKey, Status>> answers;  // not looked at yet
  std::map<Number, Status> failed;                      // in this round: at these the daemon did
  std::uint64_t taken = 0;                              // in this round
  Clock::time_point denied_until{};                     // the client was not allowed to upload
  bool is_round_over = false;  // something was refused that may pass: nothing more in this one
  KeyframeUploader uploader;
};

class UploadSpool::Sending {
 public:
  Sending(UploadSpool& spool, const SendLimits& limits)
      : spool_(spool),
        underway_(*spool.underway_),
        limits_(limits),
        latest_(std::chrono::steady_clock::now() + limits.deadline) {}

  Result<SpoolReport> Run() {
    RemoveAgain();
    Status link = underway_.is_round_over ? FinishRound() : Status();
    TakeAnswers();
    if (link.ok() && !underway_.is_round_over) link = SendAll();
    if (link.ok()) link = FinishRound();
    if (!failure_.ok()) return Error(failure_);
    if (!link.ok()) return Error(std::move(link));
    report_.waiting = spool_.waiting();
    report_.in_flight = underway_.in_flight.size();
    return report_;
  }

 private:
  Status SendAll() {
    std::vector<Number> numbers;
    for (const auto& [number, bytes] : spool_.waiting_) {
      if (!underway_.Has(number) && !spool_.undeleted_.contains(number)) numbers.push_back(number);
    }
    for (const Number number : numbers) {
      if (IsSpent()) break;
      const Result<bool> may_go_on = AwaitProbe();
      if (!may_go_on) return may_go_on.error();
      if (!*may_go_on) break;
      const Result<bool> is_sent = SendOne(number);
      TakeAnswers();
      if (!is_sent) return is_sent.error();
      if (!*is_sent || underway_.is_round_over) break;
    }
    return {};
  }

  // After a refusal keyframes go one by one, until one is taken: else all would be sent to be
  // refused once more. False: it was refused, or is not answered yet.
  Result<bool> AwaitProbe() {
    if (!spool_.is_probing_ || underway_.in_flight.empty()) return true;
    const Result<bool> is_answered = underway_.uploader.FinishUntil(latest_);
    TakeAnswers();
    if (!is_answered || !*is_answered) return is_answered;
    return !underway_.is_round_over;
  }

  bool IsSpent() const {
    return std::chrono::steady_clock::now() >= latest_ ||
           (limits_.budget_bytes != 0 && report_.sent_bytes >= limits_.budget_bytes);
  }

  // False: there was no time for it.
  Result<bool> SendOne(Number number) {
    const Result<SpooledKeyframe> keyframe = Load(number);
    if (!keyframe) return true;
    // Two under one key: the answers to them could not be told apart.
    if (underway_.in_flight.contains(keyframe->key)) {
      const Result<bool> is_answered = underway_.uploader.FinishUntil(latest_);
      if (!is_answered || !*is_answered) return is_answered;
      TakeAnswers();
    }
    const Result<bool> is_sent = underway_.uploader.UploadUntil(keyframe->ToUpload(), latest_);
    if (!is_sent || !*is_sent) return is_sent;
    underway_.in_flight[keyframe->key] = number;
    ++report_.sent;
    report_.sent_bytes += spool_.waiting_.at(number);
    return true;
  }

  // As far as the time goes.
  Status FinishRound() {
    const Result<bool> is_answered = underway_.uploader.FinishUntil(latest_);
    TakeAnswers();
    if (!is_answered) return is_answered.error();
    if (*is_answered) EndRound();
    return {};
  }

  void EndRound() {
    if (failure_.ok()) JudgeFailed();
    underway_.failed.clear();
    underway_.taken = 0;
    underway_.is_round_over = false;
  }

  // What cannot be sent is dealt with here, and stops no other.
  Result<SpooledKeyframe> Load(Number number) {
    const Result<Bytes> file = LoadFile(spool_.PathOf(number), kMaxSpooledBytes);
    Result<SpooledKeyframe> keyframe =
        file ? DecodeSpooled(*file) : Result<SpooledKeyframe>(Error(file.error()));
    if (keyframe) return keyframe;
    if (keyframe.error().code() == StatusCode::kInvalidData) {
      SetAside(number, keyframe.error());
    } else {
      if (keyframe.error().code() == StatusCode::kNotFound) spool_.Forget(number);
      NoteProblem(keyframe.error());
    }
    return keyframe;
  }

  void Remove(Number number) {
    const Status removed = spool_.Remove(number);
    if (removed.ok()) {
      ++report_.acknowledged;
    } else {
      NoteProblem(removed);
    }
  }

  // Whose files could not be deleted when they were acknowledged.
  void RemoveAgain() {
    for (const Number number : std::set<Number>(spool_.undeleted_)) {
      Remove(number);
    }
  }

  void SetAside(Number number, const Status& reason) {
    const Status status =
        spool_.SetAside(number, StrCat(StatusCodeName(reason.code()), ": ", reason.message()));
    if (status.ok()) {
      ++report_.set_aside;
    } else {
      NoteProblem(status);
    }
  }

  void NoteProblem(const Status& problem) {
    ++(problem.code() == StatusCode::kNotFound ? report_.vanished : report_.skipped);
    if (report_.problem.ok()) report_.problem = problem;
  }

  void TakeAnswers() {
    for (const auto& [key, answer] : std::exchange(underway_.answers, {})) {
      OnAnswer(key, answer);
    }
  }

  void OnAnswer(const KeyframeKey& key, const Status& answer) {
    const Number number = underway_.in_flight.at(key);
    underway_.in_flight.erase(key);
    if (answer.ok()) {
      Remove(number);
      ++underway_.taken;
      if (!underway_.is_round_over) spool_.is_probing_ = false;
    } else if (answer.code() == StatusCode::kInternal) {
      underway_.failed.emplace(number, answer);
      if (underway_.failed.size() >= kMaxFailed && underway_.taken == 0) Stop(answer);
    } else if (IsOfTheClient(answer.code(), key, underway_.atlas)) {
      if (!underway_.is_round_over) Deny();
      Stop(answer);
    } else if (IsTemporary(answer.code())) {
      Stop(answer);
    } else {
      SetAside(number, answer);
    }
  }

  // As the link does when it is not let in.
  void Deny() {
    const double part = 0.5 + 0.5 * spool_.options_.random();
    const double most_ms = static_cast<double>(spool_.options_.denied_delay.count());
    underway_.denied_until =
        Underway::Clock::now() + std::chrono::milliseconds(std::llround(part * most_ms));
  }

  void Stop(const Status& why) {
    underway_.is_round_over = true;
    spool_.is_probing_ = true;
    if (failure_.ok()) failure_ = why;
  }

  // A daemon that took others fails at these, not as a whole. They wait, for it may have been the
  // moment, but not for ever.
  void JudgeFailed() {
    for (const auto& [number, answer] : underway_.failed) {
      if (underway_.taken == 0) {
        failure_ = answer;
        return;
      }
      if (++spool_.failures_[number] < kMaxFailures) {
        NoteProblem(answer);
      } else {
        SetAside(number, answer);
      }
    }
  }

  UploadSpool& spool_;
  Underway& underway_;
  const SendLimits limits_;
  const std::chrono::steady_clock::time_point latest_;
  SpoolReport report_;
  Status failure_;  // why to stop; the link is as it was
};

UploadSpool::UploadSpool(SpoolOptions options, FolderLock lock)
    : options_(std::move(options)), lock_(std::move(lock)), sent_to_(options_.folder) {}
UploadSpool::UploadSpool(UploadSpool&&) noexcept = default;
UploadSpool& UploadSpool::operator=(UploadSpool&&) noexcept = default;
UploadSpool::~UploadSpool() = default;

Result<SpoolReport> UploadSpool::Send(AtlasClient& client, const SendLimits& limits) {
  const bool is_same = underway_ != nullptr && underway_->uploader.IsOf(client);
  SpoolReport held_back;
  held_back.retry_after = client.retry_after();
  if (is_same) held_back.retry_after = std::max(held_back.retry_after, underway_->denied_for());
  if (held_back.retry_after.count() > 0) {
    held_back.waiting = waiting();
    held_back.in_flight = is_same ? underway_->in_flight.size() : 0;
    return held_back;
  }
  if (!is_same) underway_ = std::make_unique<Underway>(client, options_.upload);
  const bool is_restored = sent_to_.IsAnother(client.atlas());
  Result<SpoolReport> report = Sending(*this, limits).Run();
  if (!report) return report;
  report->is_restored = is_restored;
  sent_to_.Note(client.atlas());
  const Status unknown = sent_to_.TakeProblem();
  if (report->problem.ok()) report->problem = unknown;
  return report;
}

}  // namespace atlas
