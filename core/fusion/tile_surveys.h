// The surveys of a whole tile, kept from one fusion of it to the next: only stretches whose
// keyframes or poses changed are surveyed again, and keyframes that follow the last one of their
// stretch are added to its survey. The tile made of them is the one that FuseTile makes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/fusion_context.h"
#include "core/fusion/fusion_stretch.h"
#include "core/fusion/stretch_survey.h"
#include "core/fusion/tile_fusion.h"

namespace atlas {

class TileSurveys {
 public:
  // What an update did, in keyframes of this tile.
  struct Work {
    std::size_t kept = 0;
    std::size_t surveyed = 0;
  };

  explicit TileSurveys(const TileId& id) : id_(id) {}

  // Brings the surveys to what FuseTile would make of `frames`. Asks `source` for the keyframes
  // that it surveys, in canonical order. After an error (the source's) the surveys are worth
  // nothing.
  Result<Work> Update(std::span<const FrameOnMap> frames,
                      const KeyframeSource& source,
                      const FusionContext& context);
  Tile Combine(const FusionContext& context) const;

  const TileId& id() const { return id_; }
  std::size_t bytes() const;

  // Compresses the surveys, to a fifth or so: Unpack() comes before anything else but bytes().
  void Pack();
  void Unpack();

 private:
  // A frame as it was surveyed.
  struct Surveyed {
    std::uint32_t sequence = 0;
    std::int32_t radius_cells = 0;
    std::int64_t time_ms = 0;
    std::uint64_t content = 0;
    KeyframePlacement placement;

    friend bool operator==(const Surveyed&, const Surveyed&) = default;
  };
  struct Stretch {
    SessionKey key;
    std::uint32_t number = 0;
    std::uint32_t session = 0;  // FusionStretch's numbers
    std::uint32_t vehicle = 0;
    std::vector<Surveyed> frames;
    StretchSurvey survey;
  };

  static Surveyed Describe(const FrameOnMap& frame);
  Stretch TakeStretch(const FusionStretch& wanted,
                      std::span<const Surveyed> frames,
                      const MapProfile& profile);
  TileBand WholeTile(const MapProfile& profile) const { return {id_, 0, profile.tile_cells}; }

  TileId id_;
  std::vector<Stretch> stretches_;  // in canonical order
};

}  // namespace atlas
