// The room on disk of a database that is open, as long as it is the file that has its name.
#pragma once

#include <filesystem>

#include "server/store/disk_room.h"

namespace atlas {

// As ReadFreeBytes of the folder of `database`, which is there. kUnavailable once it was moved,
// removed or replaced: what is written to it then is lost with it.
DiskRoom::Read FreeBytesBeside(const std::filesystem::path& database);

}  // namespace atlas
