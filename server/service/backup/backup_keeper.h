// Backups of the atlas in a folder of the daemon's machine: clients say names, never paths. One is
// written at a time. Thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/service/log_sink.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct BackupOptions {
  std::filesystem::path folder;  // there when it is needed, not made; empty: no backups
  double bytes_per_s = 0;        // 0: as fast as it goes
  // The atlas goes on growing: on a disk of its own that is half a minute of uploads.
  std::uint64_t reserve_bytes = std::uint64_t{64} << 20;
};

struct BackupRequest {
  std::string name;
  std::string author;
};

struct StoredBackup {
  std::string name;
  std::uint64_t bytes = 0;
  std::int64_t time_ms = 0;  // Unix time of the last write
};

class BackupKeeper {
 public:
  // Removes what a daemon that died had not finished.
  BackupKeeper(AtlasStore& store, LogSink log, BackupOptions options);

  // kInvalidArgument: a name that is none, or there is no folder for backups. kConflict: there is a
  // file of that name. kUnavailable: another one is being written. Else as AtlasStore::WriteBackup.
  // `work` says what ends it and who is told how far it is.
  Result<AtlasFacts> Write(const BackupRequest& request, BackupWork work);
  // Files in the folder that have a backup's name, by name.
  Result<std::vector<StoredBackup>> List() const;

 private:
  Status CheckFolder() const;
  void Note(const BackupRequest& request, const AtlasFacts& facts);

  AtlasStore& store_;
  const LogSink log_;
  const BackupOptions options_;
  std::mutex writing_;
};

}  // namespace atlas
