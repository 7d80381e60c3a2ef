// Put before the system's library (LD_PRELOAD): syncs fail while the file that $FAILING_SYNC names
// is there.
#include <cerrno>
#include <cstdlib>

#include <unistd.h>

namespace {

int SyncUnlessItFails() {
  const char* const file = std::getenv("FAILING_SYNC");
  if (file != nullptr && access(file, F_OK) == 0) {
    errno = EIO;
    return -1;
  }
  return 0;  // no power fails in a test
}

}  // namespace

extern "C" {

int fsync(int /*fd*/) {
  return SyncUnlessItFails();
}

int fdatasync(int /*fd*/) {
  return SyncUnlessItFails();
}
}
