// What a disk and SQLite can do at best: the same bytes, in one table, and nothing else.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "core/base/status.h"
#include "tests/bench/serving/stored_uploads.h"
#include "tests/bench/serving/upload_figures.h"

namespace atlas::testing {

// Appends `count` blobs, those given in turn, as the daemon's database is set: write-ahead log,
// synchronous=FULL, pages of 8 KiB, 64 rows a transaction. The file is made if it is missing.
Result<UploadFigures> WriteRaw(std::span<const StoredUpload> uploads,
                               std::size_t count,
                               const std::filesystem::path& file);

}  // namespace atlas::testing
