// Which call to the disk is to fail, for those who stand between the program and the disk.
#pragma once

#include <filesystem>

#include "tests/server/store/faulty_vfs.h"
#include "tests/server/store/volatile_files.h"

namespace atlas {

// Whether this call, one of `kind`, is to fail. `what` says in a word what it does.
bool IsToFail(FaultyVfs::Calls kind, const char* what, const std::filesystem::path& path);
VolatileFiles& TheFiles();

}  // namespace atlas
