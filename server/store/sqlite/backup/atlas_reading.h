// An atlas read back as a whole: every row against its checksum, every blob against its hash, every
// table, counter and index against what it should hold.
#pragma once

#include <filesystem>

#include "core/base/status.h"
#include "server/store/backup_types.h"

namespace atlas {

// A file that nobody has open. Tells its progress and keeps to the pace of `work`. kInvalidData
// names what is damaged, kUnsupported: of another schema version.
Result<AtlasFacts> ReadAtlasBack(const std::filesystem::path& file, const BackupWork& work);

}  // namespace atlas
