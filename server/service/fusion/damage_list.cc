#include "server/service/fusion/damage_list.h"

#include "core/base/str_cat.h"

namespace atlas {

bool DamageList::Add(const TileId& id, const Status& why, bool is_noted) {
  const std::lock_guard lock(mutex_);
  Damage& listed = tiles_[id];
  const bool is_new = !(listed.why == why);
  listed = {why, is_noted};
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

bool DamageList::IsNoted(const TileId& id, const Status& why) const {
  const std::lock_guard lock(mutex_);
  const auto found = tiles_.find(id);
  return found != tiles_.end() && found->second.is_noted && found->second.why == why;
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
  const auto& [id, damage] = *tiles_.begin();
  return Status(
      StatusCode::kInvalidData,
      StrCat(tiles_.size(), " tiles cannot be fused and keep the content they have; tile ", id,
             ": ", damage.why.message()));
}

}  // namespace atlas
