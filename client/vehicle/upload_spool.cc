#include "client/vehicle/upload_spool.h"

#include <charconv>
#include <optional>
#include <string>
#include <utility>

#include "client/vehicle/retry.h"
#include "client/vehicle/spooled_keyframe.h"
#include "client/vehicle/stored_file.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSuffix = ".keyframe";
constexpr std::string_view kReasonSuffix = ".reason";
constexpr std::size_t kDigits = 16;
// No spool comes so far; a file named above it is not ours, and numbers never outgrow their digits.
constexpr std::uint64_t kMaxNumber = 1'000'000'000'000'000;

std::string NameOf(std::uint64_t number, std::string_view suffix) {
  const std::string digits = std::to_string(number);
  return StrCat(std::string(kDigits - std::min(kDigits, digits.size()), '0'), digits, suffix);
}

std::optional<std::uint64_t> NumberFrom(std::string_view name) {
  if (name.size() != kDigits + kSuffix.size() || !name.ends_with(kSuffix)) return std::nullopt;
  std::uint64_t number = 0;
  const char* end = name.data() + kDigits;
  const auto [stop, error] = std::from_chars(name.data(), end, number);
  const bool is_number = error == std::errc() && stop == end && number <= kMaxNumber;
  return is_number ? std::optional(number) : std::nullopt;
}

void RemoveFile(const fs::path& path) {
  std::error_code ignored;  // it is sent again, which the daemon takes for the duplicate that it is
  fs::remove(path, ignored);
}

// The numbered files of a folder; what writes that never ended left is removed.
std::map<std::uint64_t, std::uint64_t> Numbered(const fs::path& folder) {
  std::map<std::uint64_t, std::uint64_t> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.ends_with(kPartialSuffix)) RemoveFile(entry->path());
    std::error_code unreadable;
    const auto number = NumberFrom(name);
    const std::uint64_t bytes = entry->file_size(unreadable);
    if (number && !unreadable) files[*number] = bytes;
  }
  return files;
}

std::uint64_t Sum(const std::map<std::uint64_t, std::uint64_t>& files) {
  std::uint64_t sum = 0;
  for (const auto& [number, bytes] : files) {
    sum += bytes;
  }
  return sum;
}

// Not the keyframe is refused, but whoever sends it.
bool IsOfTheClient(StatusCode code) {
  return code == StatusCode::kPermissionDenied;
}

}  // namespace

Result<UploadSpool> UploadSpool::Open(const SpoolOptions& options) {
  UploadSpool spool(options);
  if (Status status = spool.Scan(); !status.ok()) return Error(std::move(status));
  return spool;
}

Status UploadSpool::Scan() {
  ATLAS_RETURN_IF_ERROR(MakeFolder(refused_folder()));
  waiting_ = Numbered(options_.folder);
  refused_ = Numbered(refused_folder());
  waiting_bytes_ = Sum(waiting_);
  refused_bytes_ = Sum(refused_);
  for (const auto* files : {&waiting_, &refused_}) {
    if (!files->empty()) next_ = std::max(next_, files->rbegin()->first + 1);
  }
  return {};
}

fs::path UploadSpool::PathOf(Number number) const {
  return options_.folder / NameOf(number, kSuffix);
}

Status UploadSpool::Put(const KeyframeUpload& upload) {
  ATLAS_RETURN_IF_ERROR(upload.key.Validate());
  const Bytes file = EncodeSpooled(upload);
  if (file.size() > kMaxSpooledBytes) {
    return {StatusCode::kInvalidArgument,
            StrCat("keyframe ", upload.key, ": ", upload.blob.size(), " bytes are too many")};
  }
  if (waiting_bytes_ + file.size() > options_.max_bytes) {
    return {StatusCode::kResourceExhausted,
            StrCat("upload spool: ", waiting_.size(), " keyframes of ", waiting_bytes_,
                   " bytes wait, no room for ", file.size(), " more of ", options_.max_bytes)};
  }
  ATLAS_RETURN_IF_ERROR(StoreFile(PathOf(next_), file, Durability::kOnDevice));
  waiting_[next_++] = file.size();
  waiting_bytes_ += file.size();
  return {};
}

std::uint64_t UploadSpool::Forget(Number number) {
  const auto found = waiting_.find(number);
  const std::uint64_t bytes = found->second;
  waiting_bytes_ -= bytes;
  waiting_.erase(found);
  return bytes;
}

void UploadSpool::Remove(Number number) {
  RemoveFile(PathOf(number));
  Forget(number);
}

Status UploadSpool::SetAside(Number number, const std::string& reason) {
  const fs::path reason_path = refused_folder() / NameOf(number, kReasonSuffix);
  const std::string text = reason + "\n";
  const Bytes bytes(text.begin(), text.end());
  ATLAS_RETURN_IF_ERROR(StoreFile(reason_path, bytes, Durability::kOnDevice));
  const Status moved = MoveFile(PathOf(number), refused_folder() / NameOf(number, kSuffix));
  if (!moved.ok()) RemoveFile(reason_path);
  if (moved.code() == StatusCode::kNotFound) Forget(number);
  ATLAS_RETURN_IF_ERROR(moved);
  refused_bytes_ += refused_[number] = Forget(number);
  TrimRefused();
  return {};
}

Status UploadSpool::PutBack(Number number) {
  const std::uint64_t bytes = refused_.at(number);
  if (waiting_bytes_ + bytes > options_.max_bytes) {
    return {StatusCode::kResourceExhausted,
            StrCat("upload spool: ", waiting_bytes_, " bytes wait, no room for ", bytes,
                   " that were refused, of ", options_.max_bytes)};
  }
  const Status moved = MoveFile(refused_folder() / NameOf(number, kSuffix), PathOf(number));
  if (!moved.ok() && moved.code() != StatusCode::kNotFound) return moved;
  RemoveFile(refused_folder() / NameOf(number, kReasonSuffix));
  refused_.erase(number);
  refused_bytes_ -= bytes;
  ATLAS_RETURN_IF_ERROR(moved);
  waiting_[number] = bytes;
  waiting_bytes_ += bytes;
  return {};
}

Result<std::size_t> UploadSpool::RetryRefused() {
  const std::map<Number, std::uint64_t> refused = refused_;
  std::size_t count = 0;
  Status failure;
  for (const auto& [number, bytes] : refused) {
    const Status status = PutBack(number);
    count += status.ok() ? 1U : 0U;
    if (failure.ok()) failure = status;
  }
  if (count == 0 && !failure.ok()) return Error(failure);
  return count;
}

void UploadSpool::TrimRefused() {
  while (refused_bytes_ > options_.max_refused_bytes && !refused_.empty()) {
    const auto oldest = refused_.begin();
    RemoveFile(refused_folder() / NameOf(oldest->first, kSuffix));
    RemoveFile(refused_folder() / NameOf(oldest->first, kReasonSuffix));
    refused_bytes_ -= oldest->second;
    refused_.erase(oldest);
  }
}

// One run through the queue.
class UploadSpool::Sending {
 public:
  Sending(UploadSpool& spool, AtlasClient& client)
      : spool_(spool), uploader_(client, OptionsOf(spool.options_)) {}

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
    } else if (MaySucceedLater(answer.code()) || IsOfTheClient(answer.code())) {
      if (failure_.ok()) failure_ = answer;
    } else {
      SetAside(number, answer);
    }
  }

  UploadSpool& spool_;
  std::map<KeyframeKey, Number> in_flight_;
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
