// Records one after the other in a file, each with its checksum. What a write that never ended left
// is cut off when the file is opened again.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

// One thread at a time.
class WorkLog {
 public:
  // Calls `on_record` with each that is whole, up to the first that is not; false: it is none, and
  // the log ends before it. Else errors are those of the disk.
  static Result<WorkLog> Open(const std::filesystem::path& file,
                              const std::function<bool(ByteSpan)>& on_record);

  // It is in the file once the log is closed or some hundred others have followed.
  // kResourceExhausted on a full disk, else what the disk said.
  Status Append(ByteSpan record);

 private:
  struct FileCloser {
    void operator()(std::FILE* file) const { static_cast<void>(std::fclose(file)); }
  };

  WorkLog(std::FILE* file, std::filesystem::path path) : file_(file), path_(std::move(path)) {}

  std::unique_ptr<std::FILE, FileCloser> file_;
  std::filesystem::path path_;
};

}  // namespace atlas
