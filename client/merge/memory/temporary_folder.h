// A folder among temporary ones for as long as somebody works in it. What a program that was killed
// left there goes with the next that makes one.
#pragma once

#include <filesystem>

#include "client/vehicle/folder_lock.h"
#include "core/base/status.h"

namespace atlas {

struct TemporaryFolder {
  std::filesystem::path path;  // whoever has it removes it
  FolderLock lock;             // it is in use
};

// `among`: as the system's temporary folder. Removes those that this user made there more than an
// hour ago and nobody has locked; what cannot be removed stays. Errors are those of the disk.
Result<TemporaryFolder> MakeTemporaryFolder(const std::filesystem::path& among);

}  // namespace atlas
