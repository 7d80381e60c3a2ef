#include "tests/bench/updates/atlas_at_work.h"

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <future>
#include <stdexcept>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/await.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/bench/updates/batch_build.h"

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

AtlasAtWork::AtlasAtWork(const MapProfile& profile, const FusionOptions& fusion)
    : directory_(NewDirectory()), profile_(profile), fusion_(fusion) {
  fusion_.building.survey_files.directory = directory_ / "surveys";
  Open();
  Start();
}

void AtlasAtWork::Open() {
  SqliteStoreOptions options;
  options.directory = directory_;
  options.new_profile = profile_;
  auto store = OpenSqliteStore(options);
  if (!store) {
    throw std::runtime_error(store.error().message());
  }
  store_ = *std::move(store);
}

void AtlasAtWork::Start() {
  ServiceOptions service;
  service.fusion = fusion_;
  service_ = std::make_unique<AtlasService>(
      *store_, NowMs, [](LogLevel, const std::string&) {}, service);
}

void AtlasAtWork::Restart() {
  service_.reset();
  store_.reset();
  Open();
  Start();
}

AtlasAtWork::~AtlasAtWork() {
  service_.reset();
  store_.reset();
  std::error_code ignored;
  std::filesystem::remove_all(directory_, ignored);
}

class Meter {
 public:
  explicit Meter(std::uint64_t built) : built_(built) {}

  UpdateCost Read(std::uint64_t tiles, std::uint64_t built) const {
    const std::chrono::duration<double, std::milli> wall_ms =
        std::chrono::steady_clock::now() - wall_;
    return {CpuMs() - cpu_ms_, wall_ms.count(), tiles, built - built_};
  }

 private:
  std::uint64_t built_;
  double cpu_ms_ = CpuMs();
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
};

template <typename T, typename Begin>
Result<UpdateCost> AtlasAtWork::Measure(const Begin& begin) {
  const Meter meter(service_->ReadStatus()->tiles_built);
  const Result<T> accepted = Await<T>(begin);
  if (!accepted) {
    return Error(accepted.error());
  }
  if (Status status = service_->WaitForRevision(accepted->revision, {kPatience, {}});
      !status.ok()) {
    return Error(std::move(status));
  }
  return meter.Read(accepted->tiles_marked, service_->ReadStatus()->tiles_built);
}

Result<UpdateCost> AtlasAtWork::UploadAll(std::vector<UploadRequest> requests) {
  const Meter meter(service_->ReadStatus()->tiles_built);
  std::vector<std::future<Result<PutKeyframeResult>>> accepted;
  for (UploadRequest& request : requests) {
    accepted.push_back(Begin<PutKeyframeResult>(
        [&](auto done) { service_->Upload(std::move(request), std::move(done)); }));
  }
  std::uint64_t tiles = 0;
  for (auto& upload : accepted) {
    const auto result = upload.get();
    if (!result) {
      return Error(result.error());
    }
    tiles += result->tiles_marked;
  }
  const auto clean = service_->WaitUntilClean({kPatience, {}});
  if (!clean) {
    return Error(clean.error());
  }
  return meter.Read(tiles, service_->ReadStatus()->tiles_built);
}

Result<UpdateCost> AtlasAtWork::BuildCold(const std::vector<TileId>& tiles) {
  service_.reset();
  std::filesystem::remove_all(fusion_.building.survey_files.directory);
  const auto marked =
      Await<std::uint32_t>([&](auto done) { store_->MarkDirty(tiles, std::move(done)); });
  if (!marked) {
    return Error(marked.error());
  }
  const Meter meter(0);
  Start();
  const auto clean = service_->WaitUntilClean({kPatience, {}});
  if (!clean) {
    return Error(clean.error());
  }
  return meter.Read(tiles.size(), service_->ReadStatus()->tiles_built);
}

Result<UpdateCost> AtlasAtWork::BuildBatch(const std::set<TileId>& tiles) {
  service_.reset();
  const Meter meter(0);
  const auto built = atlas::testing::BuildBatch(*store_, tiles);
  if (!built) {
    return Error(built.error());
  }
  const UpdateCost cost = meter.Read(tiles.size(), built->size());
  for (const auto& [id, payload_hash] : *built) {
    const auto stored = store_->ReadTile(id);
    if (!stored || !*stored || (*stored)->payload_hash != payload_hash) {
      return Error(StatusCode::kInternal, StrCat("tile ", id, " is not what is stored"));
    }
  }
  return cost;
}

std::uint64_t AtlasAtWork::DatabaseBytes() const {
  Connection connection({directory_ / "atlas.db"});
  return static_cast<std::uint64_t>(connection.Ask("PRAGMA page_count") *
                                    connection.Ask("PRAGMA page_size"));
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
