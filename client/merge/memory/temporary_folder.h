// A folder for as long as somebody works in it. What a program that was killed left goes with the
// next that makes one there.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include "client/vehicle/folder_lock.h"
#include "core/base/status.h"

namespace atlas {

struct TemporaryFolder {
  std::filesystem::path path;  // whoever has it removes it
  FolderLock lock;             // it is in use
};

struct TemporaryPlace {
  std::filesystem::path among;  // the folder that it is made in
  std::string prefix;           // of its name
  // Left by somebody is what was made so long ago and nobody has locked: a new one is not locked
  // for a moment.
  std::chrono::seconds least_age{0};
};

// Removes those of that place that this user left; what cannot be removed stays. Errors are those
// of the disk.
Result<TemporaryFolder> MakeTemporaryFolder(const TemporaryPlace& place);

}  // namespace atlas
