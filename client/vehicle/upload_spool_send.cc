// UploadSpool::Send: one run through the queue.
#include <string>
#include <utility>

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

class UploadSpool::Sending {
 public:
  Sending(UploadSpool& spool, AtlasClient& client)
      : spool_(spool), atlas_(client.atlas()), uploader_(client, OptionsOf(spool.options_)) {}

  Result<SpoolReport> Run() {
    std::vector<Number> numbers;
    for (const auto& [number, bytes] : spool_.waiting_) {
      numbers.push_back(number);
    }
    Status link;
    for (const Number number : numbers) {
      link = SendOne(number);
      if (!link.ok() || !failure_.ok()) break;
    }
    if (link.ok()) link = uploader_.Finish();
    if (failure_.ok() && link.ok()) JudgeFailed();
    if (!failure_.ok()) return Error(failure_);
    if (!link.ok()) return Error(std::move(link));
    return report_;
  }

 private:
  UploadOptions OptionsOf(const SpoolOptions& options) {
    UploadOptions upload = options.upload;
    upload.on_answer = [this](const KeyframeKey& key, const Status& answer) {
      OnAnswer(key, answer);
    };
    return upload;
  }

  Status SendOne(Number number) {
    const Result<SpooledKeyframe> keyframe = Load(number);
    if (!keyframe) return {};
    // Two under one key: the answers to them could not be told apart.
    if (in_flight_.contains(keyframe->key)) ATLAS_RETURN_IF_ERROR(uploader_.Finish());
    in_flight_[keyframe->key] = number;
    return uploader_.Upload(keyframe->ToUpload());
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

  void OnAnswer(const KeyframeKey& key, const Status& answer) {
    const Number number = in_flight_.at(key);
    in_flight_.erase(key);
    if (answer.ok()) {
      spool_.Remove(number);
      ++report_.acknowledged;
    } else if (answer.code() == StatusCode::kInternal) {
      failed_.emplace_back(number, answer);
      if (failed_.size() >= kMaxFailed && report_.acknowledged == 0) failure_ = answer;
    } else if (IsTemporary(answer.code()) || IsOfTheClient(answer.code(), key, atlas_)) {
      if (failure_.ok()) failure_ = answer;
    } else {
      SetAside(number, answer);
    }
  }

  // A daemon that took others fails at these, not as a whole. They wait, for it may have been the
  // moment, but not for ever.
  void JudgeFailed() {
    for (const auto& [number, answer] : failed_) {
      if (report_.acknowledged == 0) {
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
  const AtlasIdentity atlas_;  // as it was when the client connected
  std::map<KeyframeKey, Number> in_flight_;
  std::vector<std::pair<Number, Status>> failed_;  // at these the daemon did
  SpoolReport report_;
  Status failure_;  // why to stop; the link is as it was
  KeyframeUploader uploader_;
};

Result<SpoolReport> UploadSpool::Send(AtlasClient& client) {
  SpoolReport held_back;
  held_back.retry_after = client.retry_after();
  if (held_back.retry_after.count() > 0) return held_back;
  return Sending(*this, client).Run();
}

}  // namespace atlas
