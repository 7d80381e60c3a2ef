// A store and its service in a directory of their own, fed keyframe by keyframe: what a change
// costs until it is served.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <vector>

#include "core/base/status.h"
#include "server/service/atlas_service.h"
#include "server/store/atlas_store.h"

namespace atlas::testing {

struct UpdateCost {
  double cpu_ms = 0;        // of the whole process
  double wall_ms = 0;       // from the request to the fused tiles
  std::uint64_t tiles = 0;  // of level 0 that were marked
  std::uint64_t built = 0;  // tiles of any level
};

class AtlasAtWork {
 public:
  // Throws where the machine cannot do it.
  AtlasAtWork(const MapProfile& profile, const FusionOptions& fusion);
  AtlasAtWork(const AtlasAtWork&) = delete;
  AtlasAtWork& operator=(const AtlasAtWork&) = delete;
  ~AtlasAtWork();

  // Until it is in the tiles.
  Result<UpdateCost> Upload(UploadRequest request);
  Result<UpdateCost> UpdatePoses(PoseBatchRequest request);
  // All at once.
  Result<UpdateCost> UploadAll(std::vector<UploadRequest> requests);
  // As a daemon that ends in order and starts again.
  void Restart();
  // Builds tiles again after a restart: nothing is kept in memory or on disk, what they are made of
  // is not cached.
  Result<UpdateCost> BuildCold(const std::vector<TileId>& tiles);
  // The service ends, and one thread makes the same tiles plainly (batch_build.h); nothing is
  // written. kInternal names a tile that is not what is stored.
  Result<UpdateCost> BuildBatch(const std::set<TileId>& tiles);

  // Of the database, its log copied into it.
  std::uint64_t DatabaseBytes() const;

  AtlasStore& store() { return *store_; }
  AtlasService& service() { return *service_; }

 private:
  template <typename T, typename Begin>
  Result<UpdateCost> Measure(const Begin& begin);
  void Open();
  void Start();

  std::filesystem::path directory_;
  MapProfile profile_;
  FusionOptions fusion_;
  std::unique_ptr<AtlasStore> store_;
  std::unique_ptr<AtlasService> service_;
};

}  // namespace atlas::testing
