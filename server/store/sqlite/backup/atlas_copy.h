// The pages of an atlas in a file of their own, written as NAME.partial until they are worth it.
#pragma once

#include <cstdint>
#include <filesystem>

#include "core/base/status.h"
#include "server/store/backup_types.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// What a copy is called until it is whole.
std::filesystem::path PartialOf(const std::filesystem::path& file);
// With what SQLite may have left beside it.
void RemovePartial(const std::filesystem::path& file);

// kResourceExhausted says what is needed and what is there, on the disk of `folder`. kNotFound:
// there is no such folder.
Status RequireRoom(const std::filesystem::path& folder, std::uint64_t bytes, std::uint64_t reserve);

// `from` as its transaction sees it, to PartialOf(file), synced. Throws as Connection does.
Status CopyAtlas(Connection& from, const std::filesystem::path& file, const BackupWork& work);

// PartialOf(file) becomes `file`, durably, in the place of one that is there.
Status PublishCopy(const std::filesystem::path& file);
Status SyncFolder(const std::filesystem::path& folder);

}  // namespace atlas
