// What the stretches of a tile saw, kept from one fusion of it to the next together with the tile
// made of it: only stretches whose keyframes or poses changed are surveyed again, keyframes that
// follow the last one of their stretch are added to its survey, and only cells that were observed
// are combined again. The tile is the one that FuseTile makes. Not for preset paper, whose
// equation 2 needs all observations of a session at once.
//
// A stretch is open while it grows; later its segments settle among those of the others. In preset
// bounded, what counts no more is then set aside, compressed, and in the end forgotten, so that the
// size does not grow with the passes. If a change could make what was forgotten count again, its
// keyframes are asked for once more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "core/fusion/combination/bounded_choice.h"
#include "core/fusion/combination/cell_combiner.h"
#include "core/fusion/fusion_context.h"
#include "core/fusion/observation/frame_on_map.h"
#include "core/fusion/stretch_plan.h"
#include "core/fusion/survey/cell_set.h"
#include "core/fusion/survey/settled_segments.h"
#include "core/fusion/survey/stretch_survey.h"

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

 private:
  struct Stretch {
    SessionKey key;
    std::uint32_t number = 0;
    std::uint32_t id = 0;       // its own as long as it stays
    std::uint32_t session = 0;  // equal for equal keys, rising
    std::uint32_t vehicle = 0;  // equal for equal vehicle names, rising
    std::vector<StretchMember> frames;
    std::vector<std::int64_t> times_ms;  // of the frames: they are looked up for every segment
    std::optional<StretchSurvey> open;   // else settled
    bool has_forgotten = false;          // some of its segments are gone
    std::uint32_t used = 0;              // segments that are part of a layer
    std::uint32_t grown_at = 0;          // the count of Expect() calls then
  };

  std::vector<PlannedStretch> Plan(const TileChange& change, const MapProfile& profile);
  std::vector<bool> FindLeaving(std::span<PlannedStretch> wanted) const;
  void RestoreSpare();
  bool MayForgottenCount(const std::vector<bool>& is_leaving, const MapProfile& profile);
  void SurveyForgottenAgain(std::span<PlannedStretch> wanted);
  void TakeStretches(std::span<PlannedStretch> wanted, const MapProfile& profile);
  StretchSurvey Reopen(std::uint32_t number,
                       std::span<const StretchMember> frames,
                       const MapProfile& profile) const;
  bool IsToSettle(std::size_t i, std::int64_t latest_ms) const;
  void Settle(const MapProfile& profile);
  std::vector<std::uint32_t> PlacesById() const;
  void SetAside(BoundedChoice& choice, const MapProfile& profile, SettledSegments& spare);
  void CollectSpare(std::size_t cell, std::span<const std::uint32_t> places);
  void CombineCell(std::size_t cell, CellCombiner& combiner, std::vector<TileLayer>& out);
  // Append a cell's segments to segments_.
  void CollectSettled(std::size_t cell);
  void CollectOpen(std::size_t cell, std::uint32_t stretch);
  SegmentView View(Segment& segment, std::uint32_t stretch) const;
  void SetUsed(const SegmentView& view, bool is_used);

  TileId id_;
  std::uint32_t expected_count_ = 0;  // calls of Expect()
  std::vector<Stretch> stretches_;    // in canonical order
  std::uint32_t next_id_ = 0;         // of stretches
  SettledSegments settled_;
  SettledSegments spare_;               // packed; by the ids of stretches
  std::vector<std::uint32_t> open_;     // stretches that are
  std::vector<std::uint32_t> awaited_;  // stretches of the frames that must be added, last first
  Tile tile_;                           // without cells: there is none
  bool is_packed_ = false;
  CellSet touched_;                    // cells that changed since it was made
  std::vector<SegmentView> segments_;  // of a cell
  std::vector<SegmentView> rest_;      // of a cell, that do not count
};

static_assert(std::is_nothrow_move_constructible_v<TileSurveys>);  // vectors copy others

}  // namespace atlas
