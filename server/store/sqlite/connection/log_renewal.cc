#include "server/store/sqlite/connection/log_renewal.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <sqlite3.h>

#include "core/base/bytes.h"
#include "server/store/sqlite/connection/sqlite_error.h"

namespace atlas {
namespace {

constexpr std::size_t kStepBytes = std::size_t{64} << 10;  // the layer takes 128 KiB at most

// A file by SQLite's own layer to the system. Calls return SQLite's codes.
class LayerFile {
 public:
  LayerFile(sqlite3_vfs& vfs, std::string path)
      : path_(std::move(path)),
        memory_(static_cast<std::size_t>(vfs.szOsFile) / sizeof(std::max_align_t) + 1),
        file_(reinterpret_cast<sqlite3_file*>(memory_.data())),
        open_code_(vfs.xOpen(
            &vfs, path_.c_str(), file_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_WAL, &flags_)) {}
  LayerFile(const LayerFile&) = delete;
  LayerFile& operator=(const LayerFile&) = delete;
  ~LayerFile() {
    if (file_->pMethods != nullptr) {
      file_->pMethods->xClose(file_);
    }
  }

  int open_code() const { return open_code_; }
  int WriteAgain() {
    sqlite3_int64 size = 0;
    int code = file_->pMethods->xFileSize(file_, &size);
    Bytes bytes;
    for (sqlite3_int64 at = 0; code == SQLITE_OK && at < size;
         at += static_cast<sqlite3_int64>(bytes.size())) {
      bytes.resize(std::min(kStepBytes, static_cast<std::size_t>(size - at)));
      const int count = static_cast<int>(bytes.size());
      code = file_->pMethods->xRead(file_, bytes.data(), count, at);
      if (code == SQLITE_OK) {
        code = file_->pMethods->xWrite(file_, bytes.data(), count, at);
      }
    }
    return code == SQLITE_OK ? file_->pMethods->xSync(file_, SQLITE_SYNC_NORMAL) : code;
  }

 private:
  const std::string path_;  // the layer keeps its address
  std::vector<std::max_align_t> memory_;
  sqlite3_file* file_;
  int flags_ = 0;
  int open_code_;
};

}  // namespace

Status RenewLog(const std::filesystem::path& database) {
  const std::string path = database.string() + "-wal";
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error || size == 0) {
    return {};  // none; one that cannot be looked at is met again when it is read
  }
  const auto written_at = std::filesystem::last_write_time(path, error);
  sqlite3_initialize();
  LayerFile file(*sqlite3_vfs_find(nullptr), path);
  if (file.open_code() != SQLITE_OK) {
    return StatusFromSqliteCode(file.open_code(), "the log cannot be opened");
  }
  const int code = file.WriteAgain();
  if (!error) {
    std::filesystem::last_write_time(path, written_at, error);
  }
  return code == SQLITE_OK ? Status()
                           : StatusFromSqliteCode(code, "the log cannot be written again");
}

}  // namespace atlas
