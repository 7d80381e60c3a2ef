// What of a few files would survive a power cut: what was synced, and of what was written since
// whatever the disk got round to, in any order, sectors of a write by themselves (SQLite's
// "powersafe overwrite" is not assumed of what was never synced).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <vector>

#include "core/base/bytes.h"

namespace atlas {

class VolatileFiles {
 public:
  enum class Loss {
    kAll,      // that was not synced
    kSome,     // writes, as a coin falls
    kSectors,  // of writes, as a coin falls
  };

  // What is done to a file, in the order in which it is done. A file that is not known is durable
  // as it is found.
  void NoteOpen(const std::filesystem::path& file);
  void NoteWrite(const std::filesystem::path& file, std::uint64_t offset, ByteSpan bytes);
  void NoteTruncate(const std::filesystem::path& file, std::uint64_t size);
  void NoteSync(const std::filesystem::path& file);
  // What was written since the last sync is read, and never comes to the disk.
  void NoteFailedSync(const std::filesystem::path& file);
  void NoteDelete(const std::filesystem::path& file);
  // Before it is done. It survives a power cut once the folder was synced; until then the last ones
  // may be undone.
  void NoteRename(const std::filesystem::path& from, const std::filesystem::path& to);
  void NoteFolderSync(const std::filesystem::path& folder);
  // From now on all files are durable as they are found.
  void Forget();
  // Makes the files what they are after a power cut now, and forgets them.
  void LosePower(Loss loss, std::uint32_t seed);

 private:
  struct Change {
    std::uint64_t offset = 0;
    Bytes bytes;
    std::optional<std::uint64_t> size;  // a truncation to it
  };
  struct State {
    std::optional<Bytes> durable;  // none: nobody would find it
    std::vector<Change> changes;   // since
    bool is_deleted = false;
  };
  struct Rename {
    std::filesystem::path from;
    std::filesystem::path to;
    std::optional<Bytes> replaced;  // what was there before
  };

  void SettleFolder(const std::filesystem::path& folder);
  void UndoRenames(std::size_t kept);
  static void Apply(const Change& change, Loss loss, std::mt19937& random, Bytes& content);

  std::mutex mutex_;
  std::map<std::filesystem::path, State> files_;
  std::vector<Rename> renames_;  // that no sync made durable, in their order
};

}  // namespace atlas
