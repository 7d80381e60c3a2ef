// A backup of an atlas that is in use.
#pragma once

#include <filesystem>

#include "core/base/status.h"
#include "server/store/backup_types.h"

namespace atlas {

// Copies one state of `database` to `backup`, which appears when it is whole, synced and read back.
// Readers and the writer go on; the log cannot be emptied until all pages are copied. kConflict:
// there is a file of that name. kNotFound: its folder is not there. kResourceExhausted: there is no
// room. kInvalidData: the atlas is damaged, and the copy would be. After an error nothing is left.
Result<AtlasFacts> WriteAtlasBackup(const std::filesystem::path& database,
                                    const std::filesystem::path& backup,
                                    const BackupWork& work);

}  // namespace atlas
