// One database into another, page by page.
#pragma once

#include "server/store/sqlite/connection/connection.h"

struct sqlite3_backup;

namespace atlas {

class PageCopy {
 public:
  // `from` is in a read transaction: what others write meanwhile goes into the log, and neither
  // into the copy nor back to its beginning. `to` is empty. Both outlive this, which throws as they
  // do.
  PageCopy(Connection& from, Connection& to);
  PageCopy(const PageCopy&) = delete;
  PageCopy& operator=(const PageCopy&) = delete;
  ~PageCopy();

  // Copies so many more. True: that was all, and `to` has synced it.
  bool Step(int pages);
  // Of the last step.
  int left() const;
  int total() const;

 private:
  Connection& to_;
  sqlite3_backup* backup_;
};

}  // namespace atlas
