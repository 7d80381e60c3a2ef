#include "server/service/fusion/damage_list.h"

#include <algorithm>

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

Status DamageList::WhatKeepsAll(std::span<const TileId> ids) const {
  const std::lock_guard lock(mutex_);
  if (ids.empty() ||
      !std::all_of(ids.begin(), ids.end(), [&](const TileId& id) { return tiles_.contains(id); })) {
    return {};
  }
  return Status(StatusCode::kInvalidData,
                StrCat(ids.size(), " tiles cannot be fused and keep the content they have; tile ",
                       ids.front(), ": ", tiles_.at(ids.front()).why.message()));
}

}  // namespace atlas
