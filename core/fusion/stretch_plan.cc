#include "core/fusion/stretch_plan.h"

#include <algorithm>
#include <span>
#include <tuple>

#include "core/fusion/observation/disc.h"
#include "core/fusion/survey/fusion_stretch.h"

namespace atlas {
namespace {

// `contents` sorted.
void Remove(std::span<const std::uint64_t> contents, std::vector<PlannedStretch>& plan) {
  if (contents.empty()) {
    return;
  }
  const auto is_gone = [&](const StretchMember& frame) {
    return std::binary_search(contents.begin(), contents.end(), frame.content);
  };
  for (PlannedStretch& stretch : plan) {
    if (std::erase_if(stretch.frames, is_gone) > 0) {
      stretch.StartOver();
    }
  }
}

PlannedStretch& FindOrAdd(const KeyframeKey& key,
                          const MapProfile& profile,
                          std::vector<PlannedStretch>& plan) {
  const std::uint32_t number = StretchNumber(key, profile);
  auto found = std::lower_bound(plan.begin(), plan.end(), key.session,
                                [&](const PlannedStretch& a, const SessionKey& b) {
                                  return std::tie(a.key, a.number) < std::tie(b, number);
                                });
  if (found == plan.end() || found->key != key.session || found->number != number) {
    found = plan.insert(found, {key.session, number, {}, PlannedStretch::kNone, 0});
  }
  return *found;
}

void Place(const FrameOnMap& frame, PlannedStretch& stretch) {
  const StretchMember placed{frame.key.sequence, frame.grid.radius_cells, frame.time_ms,
                             frame.content, frame.placement};
  const auto at = std::lower_bound(
      stretch.frames.begin(), stretch.frames.end(), placed,
      [](const StretchMember& a, const StretchMember& b) { return a.sequence < b.sequence; });
  if (at != stretch.frames.end() && *at == placed) {
    return;
  }
  if (static_cast<std::size_t>(at - stretch.frames.begin()) < stretch.kept) {
    stretch.StartOver();
  }
  if (at != stretch.frames.end() && at->sequence == placed.sequence) {
    *at = placed;
  } else {
    stretch.frames.insert(at, placed);
  }
}

}  // namespace

void ApplyChange(const TileChange& change,
                 const TileId& id,
                 const MapProfile& profile,
                 std::vector<PlannedStretch>& plan) {
  const Square tile = TileSquare(id, profile);
  std::vector<std::uint64_t> absent = change.absent;
  std::vector<const FrameOnMap*> present;
  for (const FrameOnMap& frame : change.present) {
    if (Touches(FootprintDisc(frame.placement, frame.grid), tile)) {
      present.push_back(&frame);
    } else {
      absent.push_back(frame.content);
    }
  }
  std::sort(absent.begin(), absent.end());
  std::sort(present.begin(), present.end(),
            [](const FrameOnMap* a, const FrameOnMap* b) { return a->key < b->key; });
  Remove(absent, plan);
  for (const FrameOnMap* frame : present) {
    Place(*frame, FindOrAdd(frame->key, profile, plan));
  }
  std::erase_if(plan, [](const PlannedStretch& stretch) { return stretch.frames.empty(); });
}

}  // namespace atlas
