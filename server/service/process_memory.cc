#include "server/service/process_memory.h"

#include <fstream>

#include <malloc.h>
#include <unistd.h>

namespace atlas {
namespace {

// That the heap of a thread keeps behind its last block: with less, whatever decodes an upload has
// the system clear the same pages again for each.
[[maybe_unused]] constexpr int kKeptBytes = 1 << 20;

}  // namespace

std::uint64_t ResidentBytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t total_pages = 0;
  std::uint64_t resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return statm ? resident_pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

void ReturnLargeBlocks() {
#ifdef M_MMAP_THRESHOLD  // glibc: else it learns to keep them
  ::mallopt(M_MMAP_THRESHOLD, 4 << 20);
  ::mallopt(M_TRIM_THRESHOLD, kKeptBytes);
#endif
}

void ReturnFreeMemory() {
#ifdef __GLIBC__
  ::malloc_trim(0);
#endif
}

}  // namespace atlas
