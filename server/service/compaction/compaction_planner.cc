#include "server/service/compaction/compaction_planner.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"
#include "core/fusion/frame_needs.h"
#include "core/tile/tile_codec.h"

namespace atlas {
namespace {

constexpr std::uint32_t kPage = 1'024;

}  // namespace

CompactionPlanner::CompactionPlanner(AtlasStore& store, Options options)
    : store_(store),
      profile_(store.identity().profile),
      options_(std::move(options)),
      keyframes_(options_.keyframe_bytes) {}

Result<CompactionPlan> CompactionPlanner::Run() {
  if (!has_searched_) {
    if (Status status = VisitTiles(&CompactionPlanner::FindNeeded); !status.ok()) {
      return Error(std::move(status));
    }
    has_searched_ = true;
    needed_.clear();
  }
  do {
    is_settled_ = true;
    if (Status status = VisitTiles(&CompactionPlanner::CheckWithout); !status.ok()) {
      return Error(std::move(status));
    }
  } while (!is_settled_);
  CompactionPlan plan;
  plan.tiles_checked = checked_.size();
  for (const std::uint64_t content : droppable_) {
    plan.dropped.push_back(static_cast<std::int64_t>(content));
  }
  std::sort(plan.dropped.begin(), plan.dropped.end());
  return plan;
}

// In key order, with the keyframes that touch them.
Status CompactionPlanner::VisitTiles(Status (CompactionPlanner::*visit)(const TileId& id,
                                                                        const Frames& frames)) {
  std::int64_t after = -1;
  while (true) {
    const auto page = store_.ListFootprintTiles(0, after, kPage);
    if (!page) {
      return page.error();
    }
    if (page->empty()) {
      return {};
    }
    for (const TileId& id : *page) {
      ATLAS_RETURN_IF_ERROR(options_.check_stop());
      ATLAS_RETURN_IF_ERROR(VisitTile(id, visit));
    }
    after = static_cast<std::int64_t>(page->back().Key());
  }
}

Status CompactionPlanner::VisitTile(const TileId& id,
                                    Status (CompactionPlanner::*visit)(const TileId& id,
                                                                       const Frames& frames)) {
  const auto sources = store_.GatherTile(id, 0);
  if (!sources) {
    return sources.error();
  }
  const auto frames = PlaceKeyframes(sources->keyframes);
  if (!frames) {
    return frames.error();
  }
  const auto has_changed = HasChanged(id, sources->revision);
  if (!has_changed) {
    return has_changed.error();
  }
  if (*has_changed) {
    KeepAll(id, *frames);
    return {};
  }
  return (this->*visit)(id, *frames);
}

// Whether its keyframes may be others than at the plan's revision.
Result<bool> CompactionPlanner::HasChanged(const TileId& id, std::uint64_t gathered_at) {
  if (gathered_at == options_.revision) {
    return false;
  }
  const auto since = store_.GatherTile(id, options_.revision);
  if (!since) {
    return Error(since.error());
  }
  return since->is_whole || !since->keyframes.empty() || !since->gone.empty();
}

void CompactionPlanner::KeepAll(const TileId& id, const Frames& frames) {
  checked_.erase(id.Key());
  for (const FrameOnMap& frame : frames) {
    needed_.insert(frame.content);
    if (droppable_.erase(frame.content) > 0) {
      is_settled_ = false;
    }
  }
}

KeyframeSource CompactionPlanner::SourceOf(const Frames& frames) {
  return [this, &frames](std::size_t i) -> Result<KeyframeCache::Handle> {
    if (Status status = options_.check_stop(); !status.ok()) {
      return Error(std::move(status));
    }
    return ReadKeyframe(frames[i], store_, keyframes_);
  };
}

bool CompactionPlanner::MayGo(const FrameOnMap& frame) const {
  return frame.time_ms >= options_.from_ms && frame.time_ms < options_.before_ms &&
         !needed_.contains(frame.content);
}

Status CompactionPlanner::FindNeeded(const TileId& id, const Frames& frames) {
  const auto is_asked = [&](std::size_t i) {
    return MayGo(frames[i]);
  };
  const auto needed =
      FindNeededFrames(id, frames, is_asked, SourceOf(frames), profile_, options_.tile_bytes);
  if (!needed) {
    return needed.error();
  }
  for (const std::size_t i : *needed) {
    needed_.insert(frames[i].content);
    droppable_.erase(frames[i].content);
  }
  for (const FrameOnMap& frame : frames) {
    if (MayGo(frame)) {
      droppable_.insert(frame.content);
    }
  }
  return {};
}

// A tile that is another one without its droppable keyframes keeps all of them.
Status CompactionPlanner::CheckWithout(const TileId& id, const Frames& frames) {
  Frames rest;
  std::copy_if(frames.begin(), frames.end(), std::back_inserter(rest),
               [this](const FrameOnMap& frame) { return !droppable_.contains(frame.content); });
  const std::size_t dropped = frames.size() - rest.size();
  if (dropped == 0) {
    checked_.erase(id.Key());
    return {};
  }
  const auto [known, is_new] = checked_.try_emplace(id.Key(), 0);
  if (known->second == dropped) {
    return {};
  }
  const auto tile = FuseTile(id, rest, SourceOf(rest), profile_, options_.tile_bytes);
  if (!tile) {
    return tile.error();
  }
  const auto is_same = IsAsStored(*tile);
  if (!is_same) {
    return is_same.error();
  }
  if (*is_same) {
    known->second = dropped;
    return {};
  }
  KeepAll(id, frames);
  return {};
}

Result<bool> CompactionPlanner::IsAsStored(const Tile& tile) {
  const auto stored = store_.ReadTile(tile.id);
  if (!stored) {
    return Error(stored.error());
  }
  if (!*stored || tile.is_empty()) {
    return !*stored && tile.is_empty();
  }
  const auto payload = TilePayloadFromBlob((*stored)->blob);
  if (!payload) {
    return Error(payload.error().WithContext(StrCat("tile ", tile.id)));
  }
  return *payload == EncodeTilePayload(tile, profile_);
}

}  // namespace atlas
