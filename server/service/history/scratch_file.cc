#include "server/service/history/scratch_file.h"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>

#include <unistd.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

Status DiskFailure(int error) {
  StatusCode code = StatusCode::kUnavailable;
  if (error == ENOSPC || error == EDQUOT || error == EMFILE || error == ENFILE) {
    code = StatusCode::kResourceExhausted;
  } else if (error == EROFS || error == EACCES || error == EPERM) {
    code = StatusCode::kPermissionDenied;
  }
  return {code, StrCat("scratch file: ", std::generic_category().message(error))};
}

struct RecordHeader {
  std::uint64_t key = 0;
  std::uint64_t size_bytes = 0;
};

}  // namespace

Result<ScratchFile> ScratchFile::Create(const std::filesystem::path& directory) {
  std::string name = (directory / "atlas.scratch.XXXXXX").string();
  const int descriptor = ::mkstemp(name.data());
  if (descriptor < 0) {
    return Error(DiskFailure(errno).WithContext(directory.string()));
  }
  ::unlink(name.c_str());
  std::FILE* file = ::fdopen(descriptor, "w+b");
  if (file == nullptr) {
    const int error = errno;
    ::close(descriptor);
    return Error(DiskFailure(error));
  }
  return ScratchFile(file);
}

Status ScratchFile::Append(std::uint64_t key, ByteSpan bytes) {
  const RecordHeader header{key, bytes.size()};
  if (std::fwrite(&header, sizeof(header), 1, file_.get()) != 1 ||
      (!bytes.empty() && std::fwrite(bytes.data(), bytes.size(), 1, file_.get()) != 1)) {
    return DiskFailure(errno);
  }
  ++records_;
  return {};
}

Status ScratchFile::Replay(const std::function<Status(std::uint64_t key, ByteSpan bytes)>& visit) {
  if (std::fflush(file_.get()) != 0 || std::fseek(file_.get(), 0, SEEK_SET) != 0) {
    return DiskFailure(errno);
  }
  Bytes bytes;
  for (std::uint64_t i = 0; i < records_; ++i) {
    RecordHeader header;
    if (std::fread(&header, sizeof(header), 1, file_.get()) != 1) {
      return DiskFailure(EIO);
    }
    bytes.resize(header.size_bytes);
    if (!bytes.empty() && std::fread(bytes.data(), bytes.size(), 1, file_.get()) != 1) {
      return DiskFailure(EIO);
    }
    ATLAS_RETURN_IF_ERROR(visit(header.key, bytes));
  }
  return {};
}

}  // namespace atlas
