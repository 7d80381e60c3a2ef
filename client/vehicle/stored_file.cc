#include "client/vehicle/stored_file.h"

#include <cerrno>
#include <cstdio>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/disk_error.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kChecksumBytes = 8;

class OpenFile {
 public:
  OpenFile(const fs::path& path, int flags) : fd_(open(path.c_str(), flags | O_CLOEXEC, 0644)) {}
  ~OpenFile() {
    if (fd_ >= 0) close(fd_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  OpenFile(OpenFile&&) = delete;
  OpenFile& operator=(OpenFile&&) = delete;

  int fd() const { return fd_; }

 private:
  int fd_;
};

// errno of the failing call, or 0.
int WriteAll(int fd, ByteSpan bytes) {
  while (!bytes.empty()) {
    const ssize_t size = write(fd, bytes.data(), bytes.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return errno;
    bytes = bytes.subspan(static_cast<std::size_t>(size));
  }
  return 0;
}

int WritePartial(const fs::path& path, ByteSpan bytes, Durability durability) {
  const OpenFile file(path, O_WRONLY | O_CREAT | O_TRUNC);
  if (file.fd() < 0) return errno;
  const int error = WriteAll(file.fd(), bytes);
  if (error != 0 || durability == Durability::kWhole) return error;
  return fdatasync(file.fd()) == 0 ? 0 : errno;
}

int SyncFolder(const fs::path& folder) {
  const OpenFile file(folder, O_RDONLY | O_DIRECTORY);
  return file.fd() >= 0 && fsync(file.fd()) == 0 ? 0 : errno;
}

// As rename, but EEXIST where something is.
int RenameToNew(const char* from, const char* to) {
  if (renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return -1;
  // A file system that cannot do that in one step: for a moment it has both names.
  if (link(from, to) != 0) return -1;
  if (unlink(from) == 0) return 0;
  const int error = errno;
  unlink(to);
  errno = error;
  return -1;
}

using Rename = int (*)(const char*, const char*);

Status Store(const fs::path& path, ByteSpan bytes, Durability durability, Rename rename_to) {
  fs::path partial = path;
  partial += kPartialSuffix;
  int error = WritePartial(partial, bytes, durability);
  if (error == 0 && rename_to(partial.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) {
    unlink(partial.c_str());
    return DiskError("cannot write", path, error);
  }
  if (durability == Durability::kWhole) return {};
  error = SyncFolder(path.parent_path());
  if (error == 0) return {};
  unlink(path.c_str());
  return DiskError("cannot write", path, error);
}

}  // namespace

Status StoreFile(const fs::path& path, ByteSpan bytes, Durability durability) {
  return Store(path, bytes, durability, &rename);
}

Status StoreNewFile(const fs::path& path, ByteSpan bytes) {
  return Store(path, bytes, Durability::kOnDevice, &RenameToNew);
}

Result<Bytes> LoadFile(const fs::path& path, std::uint64_t max_bytes) {
  const OpenFile file(path, O_RDONLY);
  struct stat facts {};
  if (file.fd() < 0 || fstat(file.fd(), &facts) != 0) {
    return Error(DiskError("cannot read", path, errno));
  }
  const auto size = static_cast<std::uint64_t>(facts.st_size);
  if (size > max_bytes) {
    return Error(StatusCode::kInvalidData,
                 StrCat(path.string(), ": ", size, " bytes, expected at most ", max_bytes));
  }
  Bytes bytes(size);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = read(file.fd(), bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return Error(DiskError("cannot read", path, errno));
    if (got == 0) break;  // it was cut meanwhile
    done += static_cast<std::size_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

Status MakeFolder(const fs::path& folder) {
  std::error_code error;
  const bool is_new = fs::create_directories(folder, error);
  if (error) return DiskError("cannot make folder", folder, error.value());
  if (!is_new) return {};
  const fs::path parent = fs::absolute(folder).lexically_normal().parent_path();
  const int failed = SyncFolder(parent);
  return failed == 0 ? Status() : DiskError("cannot make folder", folder, failed);
}

Status MoveFile(const fs::path& from, const fs::path& to) {
  if (RenameToNew(from.c_str(), to.c_str()) != 0) return DiskError("cannot move", from, errno);
  int error = SyncFolder(to.parent_path());
  if (error == 0) error = SyncFolder(from.parent_path());
  return error == 0 ? Status() : DiskError("cannot move", from, error);
}

Bytes WithChecksum(Bytes bytes) {
  ByteWriter hash;
  hash.U64(Hash64(bytes));
  bytes.insert(bytes.end(), hash.bytes().begin(), hash.bytes().end());
  return bytes;
}

Result<ByteSpan> WithoutChecksum(ByteSpan bytes) {
  if (bytes.size() < kChecksumBytes) return Error(StatusCode::kInvalidData, "file: truncated");
  const ByteSpan content = bytes.first(bytes.size() - kChecksumBytes);
  ByteReader checksum(bytes.last(kChecksumBytes));
  if (checksum.U64() != Hash64(content)) {
    return Error(StatusCode::kInvalidData, "file: the checksum does not match");
  }
  return content;
}

}  // namespace atlas
