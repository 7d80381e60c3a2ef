// The atlas as of earlier revisions: fused again for each request, never stored. Thread-safe; what
// it hands out is for one thread at a time.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>

#include "server/service/fusion/stored_keyframes.h"
#include "server/service/region/region_query.h"
#include "server/service/verification/atlas_digest.h"
#include "server/store/atlas_store.h"

namespace atlas {

class PastAtlas {
 public:
  using CheckStop = std::function<Status()>;

  // `cache_bytes`: decoded keyframes of all requests together, held while there are any. `scratch`:
  // a directory on disk for what a digest sets aside.
  PastAtlas(AtlasStore& store, std::size_t cache_bytes, std::filesystem::path scratch);

  // Both: kInvalidArgument on a revision to come, kNotFound on one whose history is gone; a failed
  // status of `check_stop`, asked before each keyframe, ends the work at hand with it.
  Result<std::shared_ptr<TileView>> View(const RegionRequest& request, CheckStop check_stop);
  Result<AtlasDigest> Digest(std::uint64_t revision, CheckStop check_stop);

 private:
  std::shared_ptr<KeyframeCache> Keyframes();

  AtlasStore& store_;
  std::size_t cache_bytes_;
  std::filesystem::path scratch_;
  std::mutex mutex_;
  std::weak_ptr<KeyframeCache> keyframes_;
};

}  // namespace atlas
