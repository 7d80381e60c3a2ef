#include "server/store/sqlite/database_room.h"

#include <cstdint>

#include "core/base/str_cat.h"
#include "server/store/sqlite/database_files.h"

namespace atlas {

DiskRoom::Read FreeBytesBeside(const std::filesystem::path& database) {
  const auto opened = DatabaseFiles::Look(database);
  return [database, inode = opened ? opened->inode : 0]() -> Result<std::uint64_t> {
    const auto files = DatabaseFiles::Look(database);
    if (!files || files->inode != inode) {
      return Error(StatusCode::kUnavailable,
                   StrCat(database.string(),
                          " is not the file that is open any more, it was moved, removed or "
                          "replaced: put it back, or stop the daemon and see to it"));
    }
    return ReadFreeBytes(database.parent_path());
  };
}

}  // namespace atlas
