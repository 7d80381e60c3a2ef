#include "server/store/sqlite/connection/page_copy.h"

#include <SQLiteCpp/Exception.h>
#include <sqlite3.h>

namespace atlas {

PageCopy::PageCopy(Connection& from, Connection& to)
    : to_(to),
      backup_(sqlite3_backup_init(
          to.database_.getHandle(), "main", from.database_.getHandle(), "main")) {
  if (backup_ == nullptr) {
    throw SQLite::Exception(to_.database_.getHandle());
  }
}

PageCopy::~PageCopy() {
  sqlite3_backup_finish(backup_);  // its code is that of the last step
}

bool PageCopy::Step(int pages) {
  const int code = sqlite3_backup_step(backup_, pages);
  if (code != SQLITE_OK && code != SQLITE_DONE) {
    throw SQLite::Exception("copy of pages", code);
  }
  return code == SQLITE_DONE;
}

int PageCopy::left() const {
  return sqlite3_backup_remaining(backup_);
}

int PageCopy::total() const {
  return sqlite3_backup_pagecount(backup_);
}

}  // namespace atlas
