#include "tests/bench/updates/atlas_at_work.h"

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <stdexcept>
#include <utility>

#include "server/store/await.h"
#include "server/store/sqlite/sqlite_store.h"

namespace atlas::testing {
namespace {

constexpr std::chrono::minutes kPatience{10};

std::int64_t NowMs() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

double CpuMs() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

std::filesystem::path NewDirectory() {
  std::string name = (std::filesystem::temp_directory_path() / "atlas_bench_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) {
    throw std::runtime_error("cannot make " + name);
  }
  return name;
}

}  // namespace

AtlasAtWork::AtlasAtWork(const MapProfile& profile, unsigned workers) : directory_(NewDirectory()) {
  SqliteStoreOptions options;
  options.directory = directory_;
  options.new_profile = profile;
  auto store = OpenSqliteStore(options);
  if (!store) {
    throw std::runtime_error(store.error().message());
  }
  store_ = *std::move(store);
  ServiceOptions service;
  service.fusion.workers = workers;
  service_ = std::make_unique<AtlasService>(
      *store_, NowMs, [](LogLevel, const std::string&) {}, service);
}

AtlasAtWork::~AtlasAtWork() {
  service_.reset();
  store_.reset();
  std::error_code ignored;
  std::filesystem::remove_all(directory_, ignored);
}

template <typename T, typename Begin>
Result<UpdateCost> AtlasAtWork::Measure(const Begin& begin) {
  const double cpu_ms = CpuMs();
  const auto wall = std::chrono::steady_clock::now();
  const Result<T> accepted = Await<T>(begin);
  if (!accepted) {
    return Error(accepted.error());
  }
  if (Status status = service_->WaitForRevision(accepted->revision, {kPatience, {}});
      !status.ok()) {
    return Error(std::move(status));
  }
  const std::chrono::duration<double, std::milli> wall_ms = std::chrono::steady_clock::now() - wall;
  return UpdateCost{CpuMs() - cpu_ms, wall_ms.count(), accepted->tiles_marked};
}

Result<UpdateCost> AtlasAtWork::Upload(UploadRequest request) {
  return Measure<PutKeyframeResult>(
      [&](auto done) { service_->Upload(std::move(request), std::move(done)); });
}

Result<UpdateCost> AtlasAtWork::UpdatePoses(PoseBatchRequest request) {
  return Measure<PoseBatchResult>(
      [&](auto done) { service_->UpdatePoses(std::move(request), std::move(done)); });
}

}  // namespace atlas::testing
