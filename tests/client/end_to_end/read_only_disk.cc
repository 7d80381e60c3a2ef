// Put before the system's library (LD_PRELOAD): while the file that $READ_ONLY_DISK names is there,
// files are as on a disk that the system made read-only under whoever has them open: what is open
// for writing stays open, and takes nothing. (`mount -o remount,ro` refuses such a disk as busy; a
// kernel that meets an error on a disk does not ask.)
#include <cerrno>
#include <cstdarg>
#include <cstdlib>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace {

bool IsReadOnly() {
  const char* const file = std::getenv("READ_ONLY_DISK");
  if (file == nullptr || access(file, F_OK) != 0) {
    return false;
  }
  errno = EROFS;
  return true;
}

bool IsReadOnlyFile(int fd) {
  struct stat what {};
  return fstat(fd, &what) == 0 && S_ISREG(what.st_mode) && IsReadOnly();
}

template <typename Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

int Open(const char* name, const char* path, int flags, mode_t mode) {
  const bool writes = (flags & (O_WRONLY | O_RDWR | O_CREAT | O_TRUNC)) != 0;
  return writes && IsReadOnly() ? -1 : Next<int(const char*, int, ...)>(name)(path, flags, mode);
}

mode_t ModeOf(int flags, va_list rest) {
  return (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
}

}  // namespace

extern "C" {

ssize_t pwrite(int fd, const void* data, size_t size, off_t at) {
  static auto* const next = Next<ssize_t(int, const void*, size_t, off_t)>("pwrite");
  return IsReadOnlyFile(fd) ? -1 : next(fd, data, size, at);
}

ssize_t pwrite64(int fd, const void* data, size_t size, off64_t at) {
  static auto* const next = Next<ssize_t(int, const void*, size_t, off64_t)>("pwrite64");
  return IsReadOnlyFile(fd) ? -1 : next(fd, data, size, at);
}

ssize_t write(int fd, const void* data, size_t size) {
  static auto* const next = Next<ssize_t(int, const void*, size_t)>("write");
  return IsReadOnlyFile(fd) ? -1 : next(fd, data, size);
}

int ftruncate(int fd, off_t size) noexcept {
  static auto* const next = Next<int(int, off_t)>("ftruncate");
  return IsReadOnlyFile(fd) ? -1 : next(fd, size);
}

int ftruncate64(int fd, off64_t size) noexcept {
  static auto* const next = Next<int(int, off64_t)>("ftruncate64");
  return IsReadOnlyFile(fd) ? -1 : next(fd, size);
}

int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int fd = Open("open", path, flags, ModeOf(flags, rest));
  va_end(rest);
  return fd;
}

int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int fd = Open("open64", path, flags, ModeOf(flags, rest));
  va_end(rest);
  return fd;
}
}
