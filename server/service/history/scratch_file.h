// Records that are written once and read once, in their order, on disk because memory is bounded
// and they are not. The file has no name: it is gone with this, however the process ends.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

class ScratchFile {
 public:
  // kResourceExhausted when the disk is full, kPermissionDenied when it is read-only or the
  // directory is not ours, kUnavailable when it fails otherwise; as are those of the others.
  static Result<ScratchFile> Create(const std::filesystem::path& directory);

  Status Append(std::uint64_t key, ByteSpan bytes);
  // Every record, in the order they were appended. A failed status of `visit` ends it.
  Status Replay(const std::function<Status(std::uint64_t key, ByteSpan bytes)>& visit);

 private:
  struct Close {
    void operator()(std::FILE* file) const { static_cast<void>(std::fclose(file)); }
  };

  explicit ScratchFile(std::FILE* file) : file_(file) {}

  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t records_ = 0;
};

}  // namespace atlas
