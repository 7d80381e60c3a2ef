#include "server/service/fusion/damage_list.h"

#include "core/base/str_cat.h"

namespace atlas {

bool DamageList::Add(const TileId& id, const Status& why) {
  const std::lock_guard lock(mutex_);
  Status& listed = tiles_[id];
  const bool is_new = !(listed == why);
  listed = why;
  return is_new;
}

void DamageList::Remove(const TileId& id) {
  const std::lock_guard lock(mutex_);
  tiles_.erase(id);
}

bool DamageList::Contains(const TileId& id) const {
  const std::lock_guard lock(mutex_);
  return tiles_.contains(id);
}

std::size_t DamageList::size() const {
  const std::lock_guard lock(mutex_);
  return tiles_.size();
}

Status DamageList::Summary() const {
  const std::lock_guard lock(mutex_);
  if (tiles_.empty()) {
    return {};
  }
  const auto& [id, why] = *tiles_.begin();
  return Status(
      StatusCode::kInvalidData,
      StrCat(tiles_.size(), " tiles cannot be fused and keep the content they have; tile ", id,
             ": ", why.message()));
}

}  // namespace atlas
