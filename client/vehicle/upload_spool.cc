#include "client/vehicle/upload_spool.h"

#include <string>
#include <utility>

#include "client/vehicle/atlas_link.h"
#include "client/vehicle/numbered_files.h"
#include "client/vehicle/spooled_keyframe.h"
#include "client/vehicle/stored_file.h"
#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSuffix = ".keyframe";
constexpr std::string_view kReasonSuffix = ".reason";
void RemoveFile(const fs::path& path) {
  std::error_code ignored;  // of what was refused: it is met again when the spool is opened
  fs::remove(path, ignored);
}

std::uint64_t Sum(const std::map<std::uint64_t, std::uint64_t>& files) {
  std::uint64_t sum = 0;
  for (const auto& [number, bytes] : files) {
    sum += bytes;
  }
  return sum;
}

}  // namespace

Result<UploadSpool> UploadSpool::Open(const SpoolOptions& options) {
  if (Status status = MakeFolder(options.folder); !status.ok()) return Error(std::move(status));
  Result<FolderLock> lock = FolderLock::Take(options.folder);
  if (!lock) return Error(lock.error().WithContext("upload spool"));
  UploadSpool spool(options, *std::move(lock));
  if (!spool.options_.random) spool.options_.random = LinkEnvironment::Real().random;
  if (Status status = spool.Scan(); !status.ok()) return Error(std::move(status));
  return spool;
}

Status UploadSpool::Scan() {
  ATLAS_RETURN_IF_ERROR(MakeFolder(refused_folder()));
  auto waiting = NumberedFiles(options_.folder, kSuffix);
  if (!waiting) return waiting.error();
  auto refused = NumberedFiles(refused_folder(), kSuffix);
  if (!refused) return refused.error();
  waiting_ = *std::move(waiting);
  refused_ = *std::move(refused);
  waiting_bytes_ = Sum(waiting_);
  refused_bytes_ = Sum(refused_);
  for (const auto* files : {&waiting_, &refused_}) {
    if (!files->empty()) next_ = std::max(next_, files->rbegin()->first + 1);
  }
  return {};
}

fs::path UploadSpool::PathOf(Number number) const {
  return options_.folder / NumberedName(number, kSuffix);
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
  Status stored = StoreNewFile(PathOf(next_), file);
  // Somebody put a file there by hand: it is sent when the spool is opened the next time.
  while (stored.code() == StatusCode::kConflict) {
    stored = StoreNewFile(PathOf(++next_), file);
  }
  ATLAS_RETURN_IF_ERROR(stored);
  waiting_[next_++] = file.size();
  waiting_bytes_ += file.size();
  return {};
}

std::uint64_t UploadSpool::Forget(Number number) {
  const auto found = waiting_.find(number);
  const std::uint64_t bytes = found->second;
  waiting_bytes_ -= bytes;
  waiting_.erase(found);
  failures_.erase(number);
  undeleted_.erase(number);
  return bytes;
}

Status UploadSpool::Remove(Number number) {
  const fs::path path = PathOf(number);
  std::error_code error;
  fs::remove(path, error);
  if (error) {
    undeleted_.insert(number);
    return DiskError("cannot delete", path, error.value());
  }
  Forget(number);
  return {};
}

Status UploadSpool::SetAside(Number number, const std::string& reason) {
  const fs::path reason_path = refused_folder() / NumberedName(number, kReasonSuffix);
  const std::string text = reason + "\n";
  const Bytes bytes(text.begin(), text.end());
  ATLAS_RETURN_IF_ERROR(StoreFile(reason_path, bytes, Durability::kOnDevice));
  const Status moved = MoveFile(PathOf(number), refused_folder() / NumberedName(number, kSuffix));
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
  const Status moved = MoveFile(refused_folder() / NumberedName(number, kSuffix), PathOf(number));
  if (!moved.ok() && moved.code() != StatusCode::kNotFound) return moved;
  RemoveFile(refused_folder() / NumberedName(number, kReasonSuffix));
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
    RemoveFile(refused_folder() / NumberedName(oldest->first, kSuffix));
    RemoveFile(refused_folder() / NumberedName(oldest->first, kReasonSuffix));
    refused_bytes_ -= oldest->second;
    refused_.erase(oldest);
  }
}

}  // namespace atlas
