#include "core/fusion/survey/fusion_stretch.h"

#include <algorithm>

#include "core/fusion/observation/disc.h"

namespace atlas {
namespace {

std::vector<std::size_t> TouchingInOrder(const TileId& id,
                                         std::span<const FrameOnMap> frames,
                                         const MapProfile& profile) {
  const Square tile = TileSquare(id, profile);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (Touches(FootprintDisc(frames[i].placement, frames[i].grid), tile)) {
      order.push_back(i);
    }
  }
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return frames[a].key < frames[b].key; });
  return order;
}

FusionStretch Following(const FusionStretch* last, const SessionKey& key, std::uint32_t number) {
  FusionStretch stretch{&key, 0, 0, number, {}};
  if (last != nullptr) {
    stretch.session = last->session + (*last->key == key ? 0 : 1);
    stretch.vehicle = last->vehicle + (last->key->vehicle == key.vehicle ? 0 : 1);
  }
  return stretch;
}

}  // namespace

std::uint32_t StretchNumber(const KeyframeKey& key, const MapProfile& profile) {
  return profile.preset == FusionPreset::kPaper ? 0 : key.sequence / profile.stretch_keyframes;
}

std::vector<FusionStretch> CutStretches(const TileId& id,
                                        std::span<const FrameOnMap> frames,
                                        const MapProfile& profile) {
  std::vector<FusionStretch> stretches;
  for (const std::size_t i : TouchingInOrder(id, frames, profile)) {
    const KeyframeKey& key = frames[i].key;
    const std::uint32_t number = StretchNumber(key, profile);
    const FusionStretch* last = stretches.empty() ? nullptr : &stretches.back();
    if (last == nullptr || *last->key != key.session || last->number != number) {
      stretches.push_back(Following(last, key.session, number));
    }
    stretches.back().frames.push_back(i);
  }
  return stretches;
}

}  // namespace atlas
