// The tiles that cannot be fused because something they are made of is damaged, or what the store
// keeps of them is, as the workers last found. They keep the content they have and stay dirty: a
// worker tries again now and then. Thread-safe.
#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <span>

#include "core/base/status.h"
#include "core/geometry/tile_id.h"

namespace atlas {

class DamageList {
 public:
  // True when the tile was not listed with this reason before. `is_noted`: what it is made of was
  // looked at, and what is damaged of it is noted in the store.
  bool Add(const TileId& id, const Status& why, bool is_noted);
  // The tile was fused and written, or failed for another reason.
  void Remove(const TileId& id);

  bool Contains(const TileId& id) const;
  // With this reason.
  bool IsNoted(const TileId& id, const Status& why) const;
  std::size_t size() const;
  // Why none of these can be fused: kInvalidData naming how many they are, and of one what is
  // damaged. Ok where one of them is not listed, or where there are none.
  Status WhatKeepsAll(std::span<const TileId> ids) const;

 private:
  struct Damage {
    Status why;
    bool is_noted = false;
  };

  mutable std::mutex mutex_;
  std::map<TileId, Damage> tiles_;
};

}  // namespace atlas
