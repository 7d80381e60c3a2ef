#include "core/fusion/fusion_input.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "core/fusion/disc.h"

namespace atlas {
namespace {

void SortCanonically(std::vector<FusionFrame>& frames) {
  std::sort(frames.begin(), frames.end(), [](const FusionFrame& a, const FusionFrame& b) {
    return a.placed->key < b.placed->key;
  });
}

// Canonical order is the tie-break, so that sorting by time alone must keep it.
void RankByTime(std::vector<FusionFrame>& frames) {
  std::vector<std::uint32_t> by_time(frames.size());
  std::iota(by_time.begin(), by_time.end(), 0u);
  std::stable_sort(by_time.begin(), by_time.end(), [&](std::uint32_t a, std::uint32_t b) {
    return frames[a].placed->time_ms < frames[b].placed->time_ms;
  });
  for (std::uint32_t rank = 0; rank < by_time.size(); ++rank) {
    frames[by_time[rank]].time_rank = rank;
  }
}

void AddSession(const FusionFrame& frame, std::vector<FusionSession>& sessions) {
  const SessionKey& key = frame.placed->key.session;
  std::uint32_t vehicle = 0;
  if (!sessions.empty()) {
    const FusionSession& last = sessions.back();
    vehicle = last.vehicle + (last.key->vehicle == key.vehicle ? 0 : 1);
  }
  sessions.push_back({&key, vehicle, true});
}

void NumberSessions(FusionInput& input) {
  const FusionFrame* previous = nullptr;
  for (FusionFrame& frame : input.frames) {
    if (previous == nullptr || previous->placed->key.session != frame.placed->key.session) {
      AddSession(frame, input.sessions);
    } else if (previous->time_rank > frame.time_rank) {
      input.sessions.back().is_time_ordered = false;
    }
    frame.session = static_cast<std::uint32_t>(input.sessions.size() - 1);
    previous = &frame;
  }
}

}  // namespace

FusionInput PrepareFusion(const TileId& id,
                          std::span<const FrameOnMap> frames,
                          const MapProfile& profile) {
  const Square tile = TileSquare(id, profile);
  FusionInput input;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameOnMap& frame = frames[i];
    if (Touches(FootprintDisc(frame.placement, frame.grid), tile)) {
      input.frames.push_back({&frame, i, 0, frame.key.sequence, 0});
      input.max_radius_cells = std::max(input.max_radius_cells, frame.grid.radius_cells);
    }
  }
  SortCanonically(input.frames);
  RankByTime(input.frames);
  NumberSessions(input);
  return input;
}

}  // namespace atlas
