#include "tests/fuzz/support/tiny_atlas.h"

#include <fstream>
#include <iterator>
#include <utility>

#include "server/net/requests/request_conversion.h"
#include "server/store/await.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/core/support/golden_profile.h"
#include "tests/fuzz/support/request_seeds.h"

namespace atlas::fuzz {

MapProfile TinyAtlas::Profile() {
  return testing::GoldenProfile();
}

TinyAtlas::TinyAtlas() {
  SqliteStoreOptions store;
  store.directory = folder_.path() / "data";
  store.new_profile = Profile();
  store_ = OpenSqliteStore(store).value();
  ServiceOptions options;
  options.fusion.workers = 1;
  options.fusion.building.keyframe_bytes = 1u << 20;
  options.fusion.building.surveys = {1u << 20, 1u << 20};
  options.past_cache_bytes = 1u << 20;
  options.scratch_directory = folder_.path();
  service_ = std::make_unique<AtlasService>(
      *store_, [] { return kNow_ms; }, [](LogLevel, const std::string&) {}, options);
  for (const wire::Envelope& request : RequestSeeds(Profile())) {
    if (request.has_upload_keyframe()) {
      UploadRequest upload = UploadFromWire(request.upload_keyframe()).value();
      const auto put = Await<PutKeyframeResult>(
          [&](auto done) { service_->Upload(std::move(upload), std::move(done)); });
      Require(put.has_value(), "an upload is taken");
    }
  }
  const auto clean = service_->WaitUntilClean({std::chrono::seconds(60), {}});
  Require(clean && !clean->is_timed_out, "the atlas is fused");
}

Bytes TinyAtlas::Close() {
  service_.reset();
  store_.reset();
  std::ifstream in(folder_.path() / "data" / "atlas.db", std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace atlas::fuzz
