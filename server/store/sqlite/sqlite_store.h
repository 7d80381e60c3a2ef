// The atlas in one SQLite database in a directory of its own (docs/formats/store.md).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/store/atlas_store.h"

namespace atlas {

struct SqliteStoreOptions {
  std::filesystem::path directory;
  // For a directory without an atlas: what the new one agrees on, and its 16 random bytes.
  std::optional<MapProfile> new_profile;
  std::array<std::uint8_t, 16> new_atlas_id{};
  int writer_cache_kib = 32 * 1024;
  int reader_cache_kib = 1024;  // each: what is read again, tiles, is kept above
  std::size_t tile_directory_bytes = std::size_t{16}
                                     << 20;  // which tiles there are (tile_directory.h)
  std::size_t max_readers = 16;              // connections; more threads wait for one
  std::size_t max_queued_writes = 4'096;
  std::size_t max_group = 64;  // operations a commit
  // The disk failed to sync: every write is refused from then on (kUnavailable), the daemon had
  // better stop. Told once, by a thread that must not be held up.
  std::function<void(const Status&)> on_failed_sync = {};
  // Told the schema version of an atlas of an earlier one, before it is upgraded: that may take.
  std::function<void(std::int64_t)> on_upgrade = {};
  // Told what is lost because the log is damaged (log_damage.h), and where the log is kept.
  std::function<void(const std::string&)> on_damaged_log = {};
  // Told each damage that was put right before the atlas is served.
  std::function<void(const std::string&)> on_repair = {};
};

// Opens the atlas in the directory, or makes one if it is missing or empty and a profile is given.
// kNotFound: there is none and no profile. kConflict: another process has it open.
// An atlas of an earlier schema is upgraded. kUnsupported: a newer one. kInvalidData: not an atlas.
// Disk errors as in atlas_store.h. Closing it finishes what is queued.
Result<std::unique_ptr<AtlasStore>> OpenSqliteStore(const SqliteStoreOptions& options);

}  // namespace atlas
