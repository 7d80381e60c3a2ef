// When a store reads the blobs of keyframes.
#pragma once

#include <functional>
#include <string_view>
#include <utility>

#include <sqlite3.h>

namespace atlas {

// Tells whenever the blob of a keyframe is about to be read, on the thread that reads it. For
// connections that are opened while it is there; one at a time.
class BlobReads {
 public:
  explicit BlobReads(std::function<void()> on_read) {
    told = std::move(on_read);
    sqlite3_auto_extension(reinterpret_cast<void (*)()>(&Watch));
  }
  BlobReads(const BlobReads&) = delete;
  BlobReads& operator=(const BlobReads&) = delete;
  ~BlobReads() { sqlite3_cancel_auto_extension(reinterpret_cast<void (*)()>(&Watch)); }

 private:
  static int Watch(sqlite3* db, const char**, const struct sqlite3_api_routines*) {
    return sqlite3_trace_v2(db, SQLITE_TRACE_STMT, &OnStatement, nullptr);
  }
  static int OnStatement(unsigned, void*, void*, void* sql) {
    if (std::string_view(static_cast<const char*>(sql)).starts_with("SELECT blob FROM keyframes")) {
      told();
    }
    return 0;
  }
  static inline std::function<void()> told;
};

}  // namespace atlas
