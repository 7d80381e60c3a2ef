#include "server/service/process_memory.h"

#include <cstddef>
#include <fstream>

#include <malloc.h>
#include <unistd.h>

// jemalloc's, where the program is linked with it.
extern "C" int mallctl(const char* name,
                       void* old_value,
                       std::size_t* old_size,
                       void* new_value,
                       std::size_t new_size) __attribute__((weak));

namespace atlas {

std::uint64_t ResidentBytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t total_pages = 0;
  std::uint64_t resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return statm ? resident_pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

void ReturnFreeMemory() {
  if (&mallctl != nullptr) {
    mallctl("arena.4096.purge", nullptr, nullptr, nullptr, 0);  // MALLCTL_ARENAS_ALL
    return;
  }
#ifdef __GLIBC__
  ::malloc_trim(0);
#endif
}

}  // namespace atlas
