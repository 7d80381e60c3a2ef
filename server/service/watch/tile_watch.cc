#include "server/service/watch/tile_watch.h"

#include <utility>

namespace atlas {
namespace {

TileId IdOf(std::uint64_t key) {
  return TileId::FromKey(key).value();  // it was one's key
}

}  // namespace

TileWatch::TileWatch(Scope scope, std::function<void()> wake, std::size_t max_told)
    : coarsest_level_(scope.coarsest_level),
      wake_(std::move(wake)),
      max_told_(max_told),
      asked_(std::move(scope.area), scope.finest_level, scope.coarsest_level) {}

void TileWatch::TellFrom(std::uint64_t revision) {
  const std::lock_guard lock(mutex_);
  since_ = revision;
  std::erase_if(revisions_, [this](const auto& entry) { return IsOld(entry.second); });
}

void TileWatch::Add(const TileId& id, std::uint64_t revision) {
  {
    const std::lock_guard lock(mutex_);
    if (IsOld(revision) || !asked_.Has(id)) {
      return;
    }
    const bool is_first = revisions_.empty() && below_.empty() && !is_anything_;
    if (is_anything_ || IsBelow(id)) {
      return;
    }
    revisions_[id.Key()] = revision;
    if (revisions_.size() + below_.size() > max_told_) {
      LoseDetail();
    }
    if (!is_first) {
      return;
    }
  }
  wake_();
}

TileChanges TileWatch::Take() {
  TileChanges changes;
  const std::lock_guard lock(mutex_);
  for (const auto& [key, revision] : std::exchange(revisions_, {})) {
    changes.tiles.push_back({IdOf(key), revision});
  }
  for (const std::uint64_t key : std::exchange(below_, {})) {
    changes.below.push_back(IdOf(key));
  }
  changes.is_anything = std::exchange(is_anything_, false);
  return changes;
}

// One of its ancestors tells it already.
bool TileWatch::IsBelow(const TileId& id) const {
  TileId ancestor = id;
  while (!below_.empty() && ancestor.level < coarsest_level_) {
    ancestor = ancestor.Parent();
    if (below_.contains(ancestor.Key())) {
      return true;
    }
  }
  return false;
}

// To half of what may be told, so that it is not for every tile.
void TileWatch::LoseDetail() {
  while (revisions_.size() + below_.size() > max_told_ / 2 && !is_anything_) {
    const bool has_finer_tiles =
        !revisions_.empty() &&
        (below_.empty() || IdOf(revisions_.begin()->first).level < IdOf(*below_.begin()).level);
    if (has_finer_tiles) {
      CoarsenTiles();
    } else {
      CoarsenBelow();
    }
  }
  if (is_anything_) {
    revisions_.clear();
    below_.clear();
  }
}

// The tiles of the finest level that there is.
void TileWatch::CoarsenTiles() {
  const std::uint8_t level = IdOf(revisions_.begin()->first).level;
  if (level >= coarsest_level_) {
    is_anything_ = true;
    return;
  }
  while (!revisions_.empty() && IdOf(revisions_.begin()->first).level == level) {
    below_.insert(IdOf(revisions_.begin()->first).Parent().Key());
    revisions_.erase(revisions_.begin());
  }
}

void TileWatch::CoarsenBelow() {
  const std::uint8_t level = IdOf(*below_.begin()).level;
  if (level >= coarsest_level_) {
    is_anything_ = true;
    return;
  }
  while (!below_.empty() && IdOf(*below_.begin()).level == level) {
    const TileId parent = IdOf(*below_.begin()).Parent();
    below_.erase(below_.begin());
    below_.insert(parent.Key());
  }
  std::erase_if(revisions_, [this](const auto& entry) { return IsBelow(IdOf(entry.first)); });
}

}  // namespace atlas
