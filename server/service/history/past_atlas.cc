#include "server/service/history/past_atlas.h"

#include <utility>

#include "server/service/history/past_digest.h"
#include "server/service/history/past_view.h"

namespace atlas {

PastAtlas::PastAtlas(AtlasStore& store, std::size_t cache_bytes, std::filesystem::path scratch)
    : store_(store), cache_bytes_(cache_bytes), scratch_(std::move(scratch)) {}

Result<std::shared_ptr<TileView>> PastAtlas::View(const RegionRequest& request,
                                                  CheckStop check_stop) {
  const std::uint64_t revision = request.at_revision.value();
  if (Status status = store_.CheckRevision(revision); !status.ok()) {
    return Error(std::move(status));
  }
  PastOptions options{revision, Keyframes(), std::move(check_stop)};
  return std::make_shared<PastView>(store_, std::move(options), request);
}

Result<AtlasDigest> PastAtlas::Digest(std::uint64_t revision, CheckStop check_stop) {
  if (Status status = store_.CheckRevision(revision); !status.ok()) {
    return Error(std::move(status));
  }
  return ComputePastDigest(store_, {revision, Keyframes(), std::move(check_stop)}, scratch_);
}

std::shared_ptr<KeyframeCache> PastAtlas::Keyframes() {
  const std::lock_guard lock(mutex_);
  auto shared = keyframes_.lock();
  if (!shared) {
    shared = std::make_shared<KeyframeCache>(cache_bytes_);
    keyframes_ = shared;
  }
  return shared;
}

}  // namespace atlas
