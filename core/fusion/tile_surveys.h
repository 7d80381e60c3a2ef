// What the stretches of a tile saw, kept from one fusion of it to the next together with the tile
// made of it: only stretches whose keyframes or poses changed are surveyed again, keyframes that
// follow the last one of their stretch are added to its survey, and only cells that were observed
// are combined again. The tile is the one that FuseTile makes. Not for preset paper, whose
// equation 2 needs all observations of a session at once.
//
// If preset bounded has forgotten what may count after a change, the keyframes that saw it are
// asked for once more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/fusion/combined_tile.h"
#include "core/fusion/fusion_context.h"
#include "core/fusion/observation/frame_on_map.h"
#include "core/fusion/settled_stretches.h"
#include "core/fusion/stretch_plan.h"
#include "core/fusion/survey/cell_set.h"
#include "core/fusion/survey/stretch_survey.h"
#include "core/fusion/tile_stretch.h"

namespace atlas {

class TileSurveys {
 public:
  explicit TileSurveys(const TileId& id) : id_(id) {}

  // Prepares for the tile to be made of other frames than before, and returns those that must be
  // added first, in this order. What it costs besides grows with the stretches that change.
  std::vector<FrameOnMap> Expect(const TileChange& change, const FusionContext& context);
  void Add(const FrameOnMap& frame, const Keyframe& keyframe, const FusionContext& context);
  // When all were added. Valid until the next call.
  const Tile& Combine(const FusionContext& context);

  const TileId& id() const { return id_; }
  std::size_t bytes() const;
  // About what they will take when all expected frames were added.
  std::size_t ExpectedBytes(const MapProfile& profile) const;

  // Compresses the surveys, to a fifth or so: Unpack() comes before anything else but bytes().
  void Pack();
  void Unpack();

  // What Load() of the same build makes them of again, for the same profile: packed.
  Bytes Save() const;
  // `bytes` are those of a Save(). kInvalidData: there are more or fewer.
  static Result<TileSurveys> Load(ByteSpan bytes, const TileId& id, const MapProfile& profile);

 private:
  std::vector<PlannedStretch> Plan(const TileChange& change, const MapProfile& profile);
  std::vector<bool> FindStaying(std::span<PlannedStretch> wanted) const;
  void SurveyForgottenAgain(std::span<PlannedStretch> wanted) const;
  void TakeStretches(std::span<PlannedStretch> wanted, const MapProfile& profile);
  std::uint32_t NumberOf(const std::string& vehicle);
  StretchSurvey Reopen(std::uint32_t place,
                       std::span<const StretchMember> frames,
                       const MapProfile& profile) const;
  std::int64_t LatestTime() const;
  bool IsToSettle(std::size_t place, std::int64_t latest_ms) const;
  void Settle(const MapProfile& profile);

  TileId id_;
  std::uint32_t expected_count_ = 0;    // calls of Expect()
  std::vector<TileStretch> stretches_;  // in canonical order
  std::vector<std::string> vehicles_;   // by their numbers; none is ever removed
  SettledStretches settled_;
  std::vector<std::uint32_t> open_;     // places of the stretches that are
  std::vector<std::uint32_t> awaited_;  // those of the frames that must be added, last first
  CombinedTile combined_;               // may be gone
  CellSet touched_;                     // cells where more than segments changed since then
  bool is_packed_ = false;
};

static_assert(std::is_nothrow_move_constructible_v<TileSurveys>);  // vectors copy others

}  // namespace atlas
