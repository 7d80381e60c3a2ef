#include "tests/server/store/faulty_vfs.h"

#include <filesystem>
#include <mutex>
#include <stdexcept>

#include <sqlite3.h>

#include "tests/server/store/fault_plan.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;
using Calls = FaultyVfs::Calls;

struct Plan {
  std::mutex mutex;
  VolatileFiles files;
  std::uint64_t fail_at = 0;  // 0: never
  Calls calls = Calls::kAll;
  bool is_once = true;
  bool is_full = false;
  std::uint64_t counted = 0;
  std::string first;
};

Plan& ThePlan() {
  static Plan plan;
  return plan;
}

bool IsFull() {
  const std::lock_guard lock(ThePlan().mutex);
  return ThePlan().is_full;
}

// SQLite's own file lies right behind it.
struct File {
  sqlite3_file base;
  fs::path* path;
};

sqlite3_file* Real(sqlite3_file* file) {
  return reinterpret_cast<sqlite3_file*>(reinterpret_cast<File*>(file) + 1);
}
const fs::path& PathOf(sqlite3_file* file) {
  return *reinterpret_cast<File*>(file)->path;
}
sqlite3_vfs* RealVfs(sqlite3_vfs* vfs) {
  return static_cast<sqlite3_vfs*>(vfs->pAppData);
}

int Close(sqlite3_file* file) {
  const int code = Real(file)->pMethods->xClose(Real(file));
  delete reinterpret_cast<File*>(file)->path;
  return code;
}
int Read(sqlite3_file* file, void* to, int bytes, sqlite3_int64 offset) {
  return Real(file)->pMethods->xRead(Real(file), to, bytes, offset);
}
int Write(sqlite3_file* file, const void* from, int bytes, sqlite3_int64 offset) {
  const bool fails = IsToFail(Calls::kWrite, "write", PathOf(file));
  const int taken =
      fails ? bytes / 2 : bytes;  // of what a failing disk took a part is there, maybe
  const int code = Real(file)->pMethods->xWrite(Real(file), from, taken, offset);
  if (code == SQLITE_OK) {
    TheFiles().NoteWrite(PathOf(file), static_cast<std::uint64_t>(offset),
                         {static_cast<const std::uint8_t*>(from), static_cast<std::size_t>(taken)});
  }
  if (fails) {
    return IsFull() ? SQLITE_FULL : SQLITE_IOERR_WRITE;
  }
  return code;
}
int Truncate(sqlite3_file* file, sqlite3_int64 size) {
  if (IsToFail(Calls::kWrite, "truncate", PathOf(file))) {
    return SQLITE_IOERR_TRUNCATE;
  }
  TheFiles().NoteTruncate(PathOf(file), static_cast<std::uint64_t>(size));
  return Real(file)->pMethods->xTruncate(Real(file), size);
}
// Noted, not done: what survives a power cut is the notes' to say.
int Sync(sqlite3_file* file, int /*flags*/) {
  if (IsToFail(Calls::kSync, "sync", PathOf(file))) {
    TheFiles().NoteFailedSync(PathOf(file));
    return SQLITE_IOERR_FSYNC;
  }
  TheFiles().NoteSync(PathOf(file));
  return SQLITE_OK;
}
int FileSize(sqlite3_file* file, sqlite3_int64* size) {
  return IsToFail(Calls::kAll, "size", PathOf(file))
             ? SQLITE_IOERR_FSTAT
             : Real(file)->pMethods->xFileSize(Real(file), size);
}
int Lock(sqlite3_file* file, int level) {
  return IsToFail(Calls::kAll, "lock", PathOf(file))
             ? SQLITE_IOERR_LOCK
             : Real(file)->pMethods->xLock(Real(file), level);
}
int Unlock(sqlite3_file* file, int level) {
  return Real(file)->pMethods->xUnlock(Real(file), level);
}
int CheckReservedLock(sqlite3_file* file, int* is_reserved) {
  return Real(file)->pMethods->xCheckReservedLock(Real(file), is_reserved);
}
int FileControl(sqlite3_file* file, int operation, void* argument) {
  return Real(file)->pMethods->xFileControl(Real(file), operation, argument);
}
int SectorSize(sqlite3_file* file) {
  return Real(file)->pMethods->xSectorSize(Real(file));
}
int DeviceCharacteristics(sqlite3_file* file) {
  return Real(file)->pMethods->xDeviceCharacteristics(Real(file));
}
int ShmMap(sqlite3_file* file, int page, int bytes, int may_extend, void volatile** memory) {
  return IsToFail(Calls::kAll, "map", PathOf(file))
             ? SQLITE_IOERR_SHMMAP
             : Real(file)->pMethods->xShmMap(Real(file), page, bytes, may_extend, memory);
}
int ShmLock(sqlite3_file* file, int offset, int count, int flags) {
  return Real(file)->pMethods->xShmLock(Real(file), offset, count, flags);
}
void ShmBarrier(sqlite3_file* file) {
  Real(file)->pMethods->xShmBarrier(Real(file));
}
int ShmUnmap(sqlite3_file* file, int is_deleted) {
  return Real(file)->pMethods->xShmUnmap(Real(file), is_deleted);
}

// Version 2: with a shared log index, without mapped files.
constexpr sqlite3_io_methods kMethods = {2,
                                         &Close,
                                         &Read,
                                         &Write,
                                         &Truncate,
                                         &Sync,
                                         &FileSize,
                                         &Lock,
                                         &Unlock,
                                         &CheckReservedLock,
                                         &FileControl,
                                         &SectorSize,
                                         &DeviceCharacteristics,
                                         &ShmMap,
                                         &ShmLock,
                                         &ShmBarrier,
                                         &ShmUnmap,
                                         nullptr,
                                         nullptr};

int Open(sqlite3_vfs* vfs, const char* path, sqlite3_file* file, int flags, int* out_flags) {
  file->pMethods = nullptr;
  fs::path kept = path == nullptr ? "" : path;
  if (IsToFail(Calls::kAll, "open", kept)) {
    return SQLITE_CANTOPEN;
  }
  const int code = RealVfs(vfs)->xOpen(RealVfs(vfs), path, Real(file), flags, out_flags);
  if (Real(file)->pMethods == nullptr) {
    return code;
  }
  TheFiles().NoteOpen(kept);
  reinterpret_cast<File*>(file)->path = new fs::path(std::move(kept));
  file->pMethods = &kMethods;
  return code;
}
int Delete(sqlite3_vfs* vfs, const char* path, int /*is_synced*/) {
  if (IsToFail(Calls::kAll, "delete", path)) {
    return SQLITE_IOERR_DELETE;
  }
  TheFiles().NoteDelete(path);
  return RealVfs(vfs)->xDelete(RealVfs(vfs), path, 0);
}
int Access(sqlite3_vfs* vfs, const char* path, int flags, int* result) {
  return IsToFail(Calls::kAll, "access", path)
             ? SQLITE_IOERR_ACCESS
             : RealVfs(vfs)->xAccess(RealVfs(vfs), path, flags, result);
}
int FullPathname(sqlite3_vfs* vfs, const char* path, int bytes, char* full) {
  return RealVfs(vfs)->xFullPathname(RealVfs(vfs), path, bytes, full);
}
int Randomness(sqlite3_vfs* vfs, int bytes, char* out) {
  return RealVfs(vfs)->xRandomness(RealVfs(vfs), bytes, out);
}
int Sleep(sqlite3_vfs* vfs, int microseconds) {
  return RealVfs(vfs)->xSleep(RealVfs(vfs), microseconds);
}
int CurrentTime(sqlite3_vfs* vfs, double* days) {
  return RealVfs(vfs)->xCurrentTime(RealVfs(vfs), days);
}
int GetLastError(sqlite3_vfs* vfs, int bytes, char* text) {
  return RealVfs(vfs)->xGetLastError(RealVfs(vfs), bytes, text);
}
int CurrentTimeInt64(sqlite3_vfs* vfs, sqlite3_int64* ms) {
  return RealVfs(vfs)->xCurrentTimeInt64(RealVfs(vfs), ms);
}

// Once made it stays: SQLite keeps its address.
sqlite3_vfs& TheVfs() {
  static sqlite3_vfs vfs = [] {
    sqlite3_vfs* real = sqlite3_vfs_find(nullptr);
    if (real == nullptr) {
      throw std::runtime_error("SQLite has no layer to the system");
    }
    sqlite3_vfs made{};
    made.iVersion = 2;
    made.szOsFile = static_cast<int>(sizeof(File)) + real->szOsFile;
    made.mxPathname = real->mxPathname;
    made.zName = "faulty";
    made.pAppData = real;
    made.xOpen = &Open;
    made.xDelete = &Delete;
    made.xAccess = &Access;
    made.xFullPathname = &FullPathname;
    made.xRandomness = &Randomness;
    made.xSleep = &Sleep;
    made.xCurrentTime = &CurrentTime;
    made.xGetLastError = &GetLastError;
    made.xCurrentTimeInt64 = &CurrentTimeInt64;
    return made;
  }();
  return vfs;
}

}  // namespace

bool IsToFail(Calls kind, const char* what, const fs::path& path) {
  Plan& plan = ThePlan();
  const std::lock_guard lock(plan.mutex);
  if (plan.calls != Calls::kAll && plan.calls != kind) {
    return false;
  }
  ++plan.counted;
  const bool is_due = plan.fail_at != 0 &&
                      (plan.is_once ? plan.counted == plan.fail_at : plan.counted >= plan.fail_at);
  if (is_due && plan.first.empty()) {
    plan.first = std::string(what) + " " + path.filename().string();
  }
  return is_due;
}

VolatileFiles& TheFiles() {
  return ThePlan().files;
}

FaultyVfs::FaultyVfs() {
  BeginAnew();
  sqlite3_vfs_register(&TheVfs(), 1);
}

FaultyVfs::~FaultyVfs() {
  Heal();
  sqlite3_vfs_unregister(&TheVfs());
}

void FaultyVfs::FailAt(std::uint64_t number, Calls calls, Until until, bool is_full) {
  Plan& plan = ThePlan();
  const std::lock_guard lock(plan.mutex);
  plan.fail_at = number;
  plan.calls = calls;
  plan.is_once = until == Until::kOnce;
  plan.is_full = is_full;
  plan.counted = 0;
  plan.first.clear();
}

void FaultyVfs::BeginAnew() {
  TheFiles().Forget();
}

void FaultyVfs::LosePower(VolatileFiles::Loss loss, std::uint32_t seed) {
  TheFiles().LosePower(loss, seed);
}

bool FaultyVfs::Heal() {
  Plan& plan = ThePlan();
  const std::lock_guard lock(plan.mutex);
  plan.fail_at = 0;
  return !plan.first.empty();
}

std::string FaultyVfs::first() const {
  const std::lock_guard lock(ThePlan().mutex);
  return ThePlan().first;
}

}  // namespace atlas
