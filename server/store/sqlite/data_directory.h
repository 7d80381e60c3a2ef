// The daemon's data directory: who holds it, and whether there is an atlas in it. One process at a
// time, by locks on the directory and on DIR/lock, which says who, that the kernel releases however
// the process ends.
#pragma once

#include <filesystem>

#include "core/base/status.h"

namespace atlas {

class DataDirectory {
 public:
  // Makes the directory if it is missing. kConflict names the process that holds it, or the file
  // that has its name; kPermissionDenied and kUnavailable say what the disk refused,
  // kInvalidArgument when the directory holds other files but no atlas, or a link to one.
  static Result<DataDirectory> Lock(const std::filesystem::path& directory);

  DataDirectory(DataDirectory&& other) noexcept;
  DataDirectory& operator=(DataDirectory&&) = delete;
  DataDirectory(const DataDirectory&) = delete;
  DataDirectory& operator=(const DataDirectory&) = delete;
  ~DataDirectory();

  bool has_atlas() const;
  std::filesystem::path database_file() const { return directory_ / "atlas.db"; }
  // Where a new atlas is made, so that atlas.db is whole from its first moment.
  std::filesystem::path unfinished_file() const { return directory_ / "atlas.db.new"; }
  void RemoveUnfinished() const;
  // What a restore makes, that becomes database_file(). Where it is and that is not, the restore
  // was interrupted: the atlas that was there has another name.
  std::filesystem::path restored_file() const { return directory_ / "atlas.db.partial"; }
  // unfinished_file() becomes database_file(), durably.
  Status Publish() const;
  std::uint64_t StoreBytes() const;

  // To open the atlas takes room for what SQLite makes beside it, without which not even what is
  // stored can be read. Frees what was kept for that; as much is kept again where the disk has it
  // when this goes, behind all connections.
  void FreeRoom();

 private:
  DataDirectory(std::filesystem::path directory, int directory_fd, int lock_fd);
  std::filesystem::path room_file() const { return directory_ / "atlas.db.room"; }
  void KeepRoom() const;

  std::filesystem::path directory_;
  int directory_fd_ = -1;  // a file that holds a lock can be removed
  int lock_fd_ = -1;
  bool keeps_room_ = false;
};

}  // namespace atlas
