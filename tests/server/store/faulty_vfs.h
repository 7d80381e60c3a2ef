// SQLite's layer to the system (sqlite.org/vfs.html), with calls that fail: the n-th, or it and all
// behind it. For stores that are opened while it is installed. What the program does to folders
// counts as well: files get other names, the folder is synced (faulty_folders.cc).
#pragma once

#include <cstdint>
#include <string>

#include "tests/server/store/volatile_files.h"

namespace atlas {

// From its construction on SQLite's default; one at a time, and no store may outlive it.
class FaultyVfs {
 public:
  enum class Calls {
    kAll,    // but reads
    kWrite,  // of files: what they write, how long they are
    kSync,
  };
  enum class Until {
    kOnce,    // and the next call succeeds
    kHealed,  // and so do all others of these calls
  };

  FaultyVfs();
  FaultyVfs(const FaultyVfs&) = delete;
  FaultyVfs& operator=(const FaultyVfs&) = delete;
  ~FaultyVfs();

  // The `number`-th of these calls from now on fails, 1 the next, with SQLite's code for what it
  // does (writes: `is_full` says that there is no room). Reading never fails.
  void FailAt(std::uint64_t number, Calls calls, Until until, bool is_full = false);
  // All that there is survives a power cut.
  void BeginAnew();
  // As if the power had been cut, with no store open: of what was not synced some is lost.
  void LosePower(VolatileFiles::Loss loss, std::uint32_t seed);
  // Nothing fails from now on. Whether something did.
  bool Heal();
  // What failed first: "write atlas.db-wal". Empty: nothing did.
  std::string first() const;
};

}  // namespace atlas
