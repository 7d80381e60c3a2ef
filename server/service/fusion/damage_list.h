// The tiles that cannot be fused because something they are made of is damaged, as the workers last
// found. They keep the content they have and stay dirty: a worker tries again now and then.
// Thread-safe.
#pragma once

#include <cstddef>
#include <map>
#include <mutex>

#include "core/base/status.h"
#include "core/geometry/tile_id.h"

namespace atlas {

class DamageList {
 public:
  // True when the tile was not listed with this reason before.
  bool Add(const TileId& id, const Status& why);
  // The tile was fused, or failed for another reason.
  void Remove(const TileId& id);

  bool Contains(const TileId& id) const;
  std::size_t size() const;
  // kInvalidData naming how many tiles there are, and of the first what is damaged; ok without any.
  Status Summary() const;

 private:
  mutable std::mutex mutex_;
  std::map<TileId, Status> tiles_;
};

}  // namespace atlas
