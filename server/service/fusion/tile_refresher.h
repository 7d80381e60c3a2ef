// Brings tiles up to date, several at a time: a keyframe is decoded once for all of them, and what
// is known of a tile from the last time is not asked for again. Used by the workers. Thread-safe.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "core/base/status.h"
#include "core/fusion/observation/sigma_table.h"
#include "core/fusion/tile_surveys.h"
#include "server/service/fusion/stored_keyframes.h"
#include "server/service/fusion/survey_cache.h"
#include "server/service/fusion/tile_builder.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct TileRefresherOptions {
  std::size_t keyframe_bytes = std::size_t{512} << 20;  // decoded keyframes, all workers together
  std::size_t tile_bytes = std::size_t{128} << 20;      // decoded tiles, all workers together
  SurveyCacheLimits surveys =                           // kept from one time to the next
      SurveyCacheLimits::OfTotal(std::size_t{1024} << 20);
  SurveyFilesOptions survey_files;  // and where memory has no room for them
  // Surveys of the tiles at hand, a worker; a single tile may take as much as what is kept plain.
  std::size_t group_bytes = std::size_t{128} << 20;
  // What is begun when it stops is done, unless it takes longer than this from then on: what was
  // known of such a tile is lost.
  std::chrono::milliseconds stop_grace = std::chrono::seconds(5);
};

class TileRefresher {
 public:
  using OnBuilt = std::function<void(const TileId& id, Result<BuiltTile> built)>;

  TileRefresher(AtlasStore& store, const TileRefresherOptions& options, const LogSink& log);

  // Calls `on_built` once for each tile, in any order. Errors as TileBuilder's; kUnavailable:
  // `stop` was requested, and the tile was not begun then or not done within stop_grace.
  void Build(std::span<const TileId> ids, const std::stop_token& stop, const OnBuilt& on_built);

  // A tile at hand is made of its keyframes alone, all of them.
  void Forget(const TileId& id) { surveys_.Take(id); }

  // What is kept from one time to the next, in memory and on disk.
  std::size_t kept_bytes() const { return surveys_.bytes(); }
  std::size_t kept_disk_bytes() const { return survey_files_.bytes(); }
  // For a worker without work: writes something of what is kept in memory to disk; false when there
  // is nothing to do.
  bool StoreIdle();
  // To be called last: what is kept in memory goes to disk.
  std::size_t MoveToDisk();

 private:
  // A level-0 tile under way.
  struct Job {
    TileSurveys surveys;
    std::uint64_t revision = 0;
    std::vector<FrameOnMap> expected;  // frames to be added
    Status status;
  };

  Result<Job> Prepare(const TileId& id);
  void Run(std::vector<Job>& jobs,
           const TileBuilder::CheckStop& check_stop,
           const OnBuilt& on_built);
  void AddKeyframes(std::vector<Job>& jobs, const TileBuilder::CheckStop& check_stop);
  FusionContext context() const { return {profile_, sigmas_}; }

  AtlasStore& store_;
  const MapProfile profile_;
  const SigmaTable sigmas_;
  const std::size_t group_bytes_;
  const std::size_t alone_bytes_;  // the same of a tile that is alone in its group
  const std::chrono::milliseconds stop_grace_;
  KeyframeCache keyframes_;
  TileCache tiles_;
  SurveyFiles survey_files_;
  SurveyCache surveys_;
  TileBuilder builder_;  // for what is not done here
};

}  // namespace atlas
