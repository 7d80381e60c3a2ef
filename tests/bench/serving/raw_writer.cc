#include "tests/bench/serving/raw_writer.h"

#include <algorithm>
#include <chrono>

#include <SQLiteCpp/SQLiteCpp.h>

#include "core/base/str_cat.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kRowsPerCommit = 64;
constexpr const char* kSettings =
    "PRAGMA page_size = 8192; PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;"
    "PRAGMA cache_size = -32768; PRAGMA mmap_size = 0; PRAGMA journal_size_limit = 67108864;"
    "CREATE TABLE IF NOT EXISTS blobs (id INTEGER PRIMARY KEY, blob BLOB NOT NULL);";

}  // namespace

Result<UploadFigures> WriteRaw(std::span<const StoredUpload> uploads,
                               std::size_t count,
                               const std::filesystem::path& file) {
  try {
    SQLite::Database database(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    database.exec(kSettings);
    SQLite::Statement insert(database, "INSERT INTO blobs (blob) VALUES (?)");
    UploadFigures figures;
    const auto begin = std::chrono::steady_clock::now();
    while (figures.keyframes < count) {
      SQLite::Transaction transaction(database);
      const std::size_t end = std::min(count, figures.keyframes + kRowsPerCommit);
      for (; figures.keyframes < end; ++figures.keyframes) {
        const Bytes& blob = uploads[figures.keyframes % uploads.size()].blob;
        insert.reset();
        insert.bindNoCopy(1, blob.data(), static_cast<int>(blob.size()));
        insert.exec();
        figures.bytes += blob.size();
      }
      transaction.commit();
    }
    figures.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return figures;
  } catch (const SQLite::Exception& error) {
    return Error(StatusCode::kUnavailable, StrCat(file.string(), ": ", error.what()));
  }
}

}  // namespace atlas::testing
